#pragma once
/// Escapes text for HTML and XML.

#include <string>
#include <string_view>

namespace offstage::producer {

/// Replaces the characters <, >, & and " by entities, and control characters that XML 1.0 does not allow by
/// '?'.
std::string escape_markup(std::string_view text);

}  // namespace offstage::producer
