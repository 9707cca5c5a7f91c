#include "producer/cli/command_texts.h"

#include <memory>
#include <stdexcept>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/version.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"

namespace offstage::producer {
namespace {

/// An option or a positional argument of a command.
struct Argument {
  std::vector<std::string> names;    ///< "-o", "--output"; for a positional argument, its placeholder
  std::vector<std::string> choices;  ///< the allowed values, if there are only a few
  std::string help, environment;
  bool takes_value = false, required = false, positional = false, repeated = false;
};

struct CommandText {
  std::string name, help;
  std::vector<Argument> options, positionals;
};

/// Returns the words between braces in the name of a type: "exr" and "png" for TEXT:{exr,png}.
std::vector<std::string> choices_in(const std::string& type) {
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

/// Returns a text with its line breaks replaced by spaces.
std::string in_one_line(std::string text) {
  for (char& c : text)
    if (c == '\n') c = ' ';
  return text;
}

Argument argument_of(const CLI::Option& option) {
  Argument a;
  a.positional = option.get_positional();
  if (a.positional) {
    a.names = {option.get_name(true, false)};
  } else {
    for (const std::string& name : option.get_snames()) a.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) a.names.push_back("--" + name);
  }
  a.help = in_one_line(option.get_description());
  a.environment = option.get_envname();
  a.takes_value = option.get_items_expected_max() > 0;
  a.required = option.get_required();
  a.repeated = option.get_items_expected_max() > 1;
  a.choices = choices_in(option.get_type_name());
  return a;
}

CommandText command_of(const CLI::App& app) {
  CommandText c{app.get_name(), in_one_line(app.get_description()), {}, {}};
  for (const CLI::Option* option : app.get_options())
    (option->get_positional() ? c.positionals : c.options).push_back(argument_of(*option));
  return c;
}

std::vector<CommandText> commands_of(const CLI::App& program) {
  std::vector<CommandText> all;
  for (const CLI::App* app : program.get_subcommands([](const CLI::App*) { return true; }))
    all.push_back(command_of(*app));
  return all;
}

std::string with_replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

/// Returns a text in quotes that all supported shells understand.
std::string shell_word(const std::string& text) {
  return "'" + with_replaced(text, "'", "'\\''") + "'";
}

std::string option_names(const std::vector<Argument>& options) {
  std::string words;
  for (const Argument& option : options)
    for (const std::string& name : option.names) words += (words.empty() ? "" : " ") + name;
  return words;
}

// --- Manual page ---

std::string roff(std::string text) {
  text = with_replaced(with_replaced(std::move(text), "\\", "\\e"), "-", "\\-");
  return !text.empty() && (text[0] == '.' || text[0] == '\'') ? "\\&" + text : text;
}

void add_argument(std::string& page, const Argument& a) {
  page += ".TP\n";
  std::string head;
  for (const std::string& name : a.names) head += (head.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
  if (a.takes_value && !a.positional) head += " \\fIvalue\\fR";
  page += head + "\n" + roff(a.help);
  if (!a.choices.empty()) page += fmt::format(" ({})", roff(fmt::format("{}", fmt::join(a.choices, ", "))));
  if (a.required && !a.positional) page += " (required)";
  if (!a.environment.empty()) page += " (also by the environment variable \\fB" + a.environment + "\\fR)";
  page += "\n";
}

// --- Shells ---

std::string bash_completion(const CLI::App& program) {
  const std::vector<CommandText> all = commands_of(program);
  std::string names, values, options;
  for (const CommandText& c : all) {
    names += c.name + " ";
    options += fmt::format("    {}) words={} ;;\n", c.name, shell_word(option_names(c.options)));
    for (const Argument& option : c.options) {
      if (option.choices.empty()) continue;
      std::string patterns;
      for (const std::string& name : option.names)
        patterns += fmt::format("{}'{} {}'", patterns.empty() ? "" : " | ", c.name, name);
      values += fmt::format("    {}) words={} ;;\n", patterns,
                            shell_word(fmt::format("{}", fmt::join(option.choices, " "))));
    }
  }
  return fmt::format(R"(# Completion of offstage for bash, made by: offstage completion bash
_offstage() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} command=${{COMP_WORDS[1]}} words=
  case "$command $previous" in
{1}  esac
  if [ "$COMP_CWORD" = 1 ]; then
    words={0}
  elif [ -z "$words" ] && [[ $word == -* ]]; then
    case $command in
{2}    esac
  fi
  if [ -n "$words" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -o filenames -F _offstage offstage
)",
                     shell_word(names + option_names(command_of(program).options)), values, options);
}

std::string zsh_completion(const CLI::App& program) {
  const auto text = [](const std::string& help) {
    return with_replaced(with_replaced(with_replaced(help, "[", "\\["), "]", "\\]"), ":", "\\:");
  };
  const auto action = [](const Argument& a) {
    return a.choices.empty() ? ":_files" : fmt::format(":({})", fmt::join(a.choices, " "));
  };
  std::string names, cases;
  for (const CommandText& c : commands_of(program)) {
    names += "    " + shell_word(c.name + ":" + text(c.help)) + "\n";
    cases += fmt::format("    {}) _arguments", c.name);
    for (const Argument& option : c.options)
      for (const std::string& name : option.names)
        cases += " \\\n      " + shell_word((option.repeated ? "*" : "") + name + "[" + text(option.help) +
                                            "]" + (option.takes_value ? ":value" + action(option) : ""));
    for (const Argument& a : c.positionals)
      cases += " \\\n      " + shell_word((a.repeated ? "*:" : ":") + a.names[0] + action(a));
    cases += " ;;\n";
  }
  return fmt::format(R"(#compdef offstage
# Completion of offstage for zsh, made by: offstage completion zsh
local -a commands=(
{0})
if (( CURRENT == 2 )); then
  _describe command commands
else
  shift words
  (( CURRENT-- ))
  case $words[1] in
{1}  esac
fi
)",
                     names, cases);
}

std::string fish_completion(const CLI::App& program) {
  const auto quote = [](const std::string& text) {
    return "'" + with_replaced(with_replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
  };
  std::string lines = "# Completion of offstage for fish, made by: offstage completion fish\n";
  for (const CommandText& c : commands_of(program)) {
    lines +=
        fmt::format("complete -c offstage -n __fish_use_subcommand -f -a {} -d {}\n", c.name, quote(c.help));
    for (const Argument& option : c.options) {
      lines += fmt::format("complete -c offstage -n '__fish_seen_subcommand_from {}'", c.name);
      for (const std::string& name : option.names)
        lines += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (!option.choices.empty())
        lines += fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
      else if (option.takes_value)
        lines += " -r";
      lines += " -d " + quote(option.help) + "\n";
    }
  }
  return lines;
}

}  // namespace

std::string manual_page(const CLI::App& program) {
  std::string page = fmt::format(
      ".TH OFFSTAGE 1 \"\" \"offstage {}\" \"User Commands\"\n.SH NAME\noffstage \\- {}\n"
      ".SH SYNOPSIS\n.B offstage\n.I command\n[\\fIoptions\\fR]\n.SH DESCRIPTION\n{}\n"
      "The keys of scene files are described by\n.B offstage schema \\-\\-reference\n.SH COMMANDS\n",
      version(), "films of physically simulated scenes", roff(in_one_line(program.get_description())));
  for (const CommandText& c : commands_of(program)) {
    page += fmt::format(".SS \"offstage {}", c.name);
    for (const Argument& a : c.positionals) {
      const std::string name = a.names[0] + (a.repeated ? "..." : "");
      page += a.required ? " " + name : " [" + name + "]";
    }
    page += "\"\n" + roff(c.help) + ".\n";
    for (const Argument& a : c.positionals) add_argument(page, a);
    for (const Argument& a : c.options) add_argument(page, a);
  }
  page += ".SH OPTIONS\n";
  for (const Argument& a : command_of(program).options) add_argument(page, a);
  page += ".SH EXIT STATUS\n" + roff(in_one_line(program.get_footer())) + "\n";
  return page;
}

std::string shell_completion(const CLI::App& program, std::string_view shell) {
  if (shell == "bash") return bash_completion(program);
  if (shell == "zsh") return zsh_completion(program);
  if (shell == "fish") return fish_completion(program);
  throw std::invalid_argument("there is completion for bash, zsh and fish, not for " + std::string(shell));
}

Command add_man(CLI::App& app) {
  return {app.add_subcommand("man", "Print the manual page, for `man -l -`"), [&app] {
            fmt::print("{}", manual_page(app));
            return static_cast<int>(kOk);
          }};
}

Command add_completion(CLI::App& app) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("completion", "Print the completion script of a shell");
  command->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  return {command, [shell, &app] {
            fmt::print("{}", shell_completion(app, *shell));
            return static_cast<int>(kOk);
          }};
}

}  // namespace offstage::producer
