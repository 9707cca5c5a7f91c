#pragma once
/// The manual page and the completions of shells, generated from the description of the command line.

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace offstage::producer {

/// A manual page of section 1, as roff.
std::string manual_page(const CLI::App& program);

/// The completion script of "bash", "zsh" or "fish": commands, their options, the values an option chooses
/// from, and files everywhere else. Throws std::invalid_argument for another shell.
std::string shell_completion(const CLI::App& program, std::string_view shell);

}  // namespace offstage::producer
