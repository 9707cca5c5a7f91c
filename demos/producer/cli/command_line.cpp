#include "producer/cli/command_line.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <tuple>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "producer/base/error.h"
#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/base/suggest.h"
#include "producer/base/version.h"
#include "producer/build/simulation.h"
#include "producer/cli/command_texts.h"
#include "producer/cli/commands.h"
#include "producer/cli/failure.h"
#include "producer/cli/options.h"
#include "producer/run/output.h"
#include "render/error.h"
#include "render/file_io.h"

namespace offstage::producer {
namespace {

constexpr const char* kFooter =
    "A first film: offstage new rain && offstage rain.json   (SCENE.json alone renders SCENE.mp4)\n"
    "A scene named - is read from standard input.\n\n"
    "Exit codes: 0 ok, 1 run failed, 2 usage, 3 scene invalid, 4 GL or encoder unavailable, 5 simulation "
    "diverged,\n"
    "6 images differ, 130 interrupted (Ctrl-C), 143 terminated.";

/// Opens closed standard streams, because otherwise the program's own files would get their numbers.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd) {
    if (fcntl(fd, F_GETFD) >= 0) continue;
    // open() takes the lowest free number. Standard output is opened for reading only, so that writing to it
    // fails and results are not lost silently.
    open("/dev/null", fd == 2 ? O_WRONLY : O_RDONLY);
    if (fd == 1) note_closed_output();
  }
}

/// Ends the program when an exception cannot be caught: in a thread, or in a destructor during another
/// exception. If memory is exhausted, the message and the exit code are the usual ones. Unfinished files keep
/// their temporary names.
[[noreturn]] void end_program() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    constexpr std::string_view kLine = "offstage: out of memory\n";
    std::ignore = ::write(STDERR_FILENO, kLine.data(), kLine.size());
    ::_exit(kRunFailed);
  } catch (...) {
  }
  std::abort();
}

/// Runs before static objects are constructed, because memory can be exhausted there, too.
[[gnu::constructor(101)]] void install_end() {
  std::set_terminate(end_program);
}

/// Writes buffered results to standard output. Returns `code`, or the code of a failed run if writing fails.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  log("offstage: standard output cannot be written: {}\n", std::strerror(errno));
  return code == kOk ? kRunFailed : code;
}

int dispatch(int argc, char** argv, const TuneCommand& tune, const WatchCommand& watch);

}  // namespace

int run(int argc, char** argv, const TuneCommand& tune, const WatchCommand& watch) {
  open_standard_streams();
  install_signal_handlers();
  return flushed(reported([&] { return dispatch(argc, argv, tune, watch); }));
}

namespace {

bool is_scene_name(std::string_view argument) {
  return argument == kStandardInput || argument.ends_with(".json");
}

/// Returns whether the arguments have a scene file in place of a command. Such a scene is rendered.
bool lacks_command(const std::vector<const char*>& arguments, const std::vector<std::string>& commands) {
  if (arguments.size() < 2) return false;
  const std::string_view first = arguments[1];
  if (!first.starts_with('-') || first == kStandardInput) return is_scene_name(first);
  const auto is_command = [&](const char* argument) {
    return std::ranges::find(commands, argument) != commands.end();
  };
  return std::none_of(arguments.begin() + 1, arguments.end(), is_command) &&
         std::any_of(arguments.begin() + 1, arguments.end(), is_scene_name);
}

/// Returns an error message if the first argument is not a command; otherwise an empty text.
std::string wrong_command(const std::vector<const char*>& arguments,
                          const std::vector<std::string>& commands) {
  if (arguments.size() < 2 || std::string_view(arguments[1]).starts_with('-')) return {};
  const std::string word = arguments[1];
  if (std::ranges::find(commands, word) != commands.end()) return {};
  if (std::error_code error; std::filesystem::is_regular_file(word, error))
    return word + " is not a scene: a scene is a .json file, or - for standard input";
  const std::string near = nearest(word, commands);
  return "there is no command '" + word + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?") +
         " (--help lists all)";
}

Command add_tune(CLI::App& app, const TuneCommand& run) {
  const auto options = std::make_shared<TuneOptions>();
  TuneOptions& tune = *options;
  CLI::App* command = app.add_subcommand(
      "tune", "Edit a scene in the browser with a live preview; prints the address of the page");
  command->add_option("scene", tune.scene.file, "Scene file")->required();
  command->add_option("--port", tune.port, "Port on this machine (default: any that is free)")
      ->check(CLI::Range(1, 65535));
  command->add_option("--size", tune.size, "Largest size WxH of the small pictures shown first")
      ->capture_default_str();
  command->add_flag_callback(
      "--no-open", [&tune] { tune.open = false; }, "Only print the address and open no browser");
  add_allow(*command, tune.scene.allow);
  command->add_flag("--no-cache", tune.scene.no_cache,
                    "Do not use the cache of convex decompositions in ~/.cache/offstage");
  add_threads(*command, tune.threads);
  add_gl(*command, tune.gl);
  return {command, [options, run] { return run(*options); }};
}

/// Adds all commands, in the order in which --help lists them.
std::vector<Command> add_commands(CLI::App& app, const TuneCommand& tune, const WatchCommand& watch) {
  return {add_render(app, watch), add_new(app),     add_tune(app, tune), add_encode(app), add_frame(app),
          add_sheet(app),         add_sweep(app),   add_simulate(app),   add_bench(app),  add_export(app),
          add_cache(app),         add_farm(app),    add_validate(app),   add_schema(app), add_presets(app),
          add_info(app),          add_compare(app), add_bless(app),      add_doctor(app), add_man(app),
          add_completion(app)};
}

int dispatch(int argc, char** argv, const TuneCommand& tune, const WatchCommand& watch) {
  CLI::App app{"offstage turns a scene file into a physically simulated film, without a display or a GPU."};
  app.set_version_flag("--version", "offstage " + std::string(version_text()));
  app.require_subcommand(1);
  app.fallthrough(false);
  app.footer(kFooter);
  const std::vector<Command> commands = add_commands(app, tune, watch);

  std::vector<std::string> names;
  for (const Command& command : commands) names.push_back(command.arguments->get_name());
  std::vector<const char*> arguments(argv, argv + argc);
  if (lacks_command(arguments, names))
    arguments.insert(arguments.begin() + 1, "render");
  else
    app.get_subcommand("render")->get_option("--output")->required();
  if (const std::string wrong = wrong_command(arguments, names); !wrong.empty()) {
    log("offstage: {}\n", wrong);
    return kUsage;
  }
  try {
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  for (const Command& command : commands)
    if (*command.arguments) return reported(command.run);
  return kUsage;
}

}  // namespace

}  // namespace offstage::producer
