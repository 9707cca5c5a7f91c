#pragma once
/// Escapes text for HTML and XML.

#include <string>
#include <string_view>

namespace offstage::producer {

/// The characters <, >, & and " as entities; control characters that XML 1.0 does not allow become '?'.
std::string escape_markup(std::string_view text);

}  // namespace offstage::producer
