#pragma once
/// The manual page and the completions of shells, generated from the description of the command line.

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace offstage::producer {

/// Returns the manual page of the program (section 1), as roff.
std::string manual_page(const CLI::App& program);

/// Returns the completion script for a shell: "bash", "zsh" or "fish". The script completes commands, options
/// and the allowed values of options, and file names everywhere else. Throws std::invalid_argument for
/// another shell.
std::string shell_completion(const CLI::App& program, std::string_view shell);

}  // namespace offstage::producer
