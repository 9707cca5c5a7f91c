#include "producer/cli/failure.h"

#include <new>
#include <stdexcept>

#include "producer/base/error.h"
#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/build/simulation.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/run/output.h"
#include "render/error.h"
#include "render/file_io.h"

namespace offstage::producer {

Failure describe_failure(const std::exception_ptr& error) {
  const auto line = [](const char* what) { return "offstage: " + render::escaped(what); };
  try {
    std::rethrow_exception(error);
  } catch (const render::StoppedError&) {
    throw;
  } catch (const Interrupted&) {
    throw;
  } catch (const SceneError& e) {
    return {kSceneInvalid, "scene invalid", e.what()};
  } catch (const OutputError& e) {
    return {kUsage, "usage", line(e.what())};
  } catch (const std::invalid_argument& e) {
    return {kUsage, "usage", line(e.what())};
  } catch (const render::UnavailableError& e) {
    return {kUnavailable, "unavailable", std::string("offstage: ") + e.what()};
  } catch (const DivergedError& e) {
    return {kDiverged, "simulation diverged", std::string("offstage: ") + e.what()};
  } catch (const std::bad_alloc&) {
    return {kRunFailed, "out of memory", "offstage: out of memory"};
  } catch (const std::exception& e) {
    return {kRunFailed, "run failed", line(e.what())};
  }
}

int reported(const std::function<int()>& command) {
  try {
    return command();
  } catch (const DivergedError& error) {
    log("offstage: {}\n", error.what());
    try {
      log("the last state was saved to {}\n",
          write_numbered_file("offstage-diverged", ".json", error.state()));
    } catch (const render::FileError& unsaved) {
      log("warning: the state at the divergence was not saved: {}\n", unsaved.what());
    }
    return kDiverged;
  } catch (const render::StoppedError&) {
    log("interrupted\n");
    return 128 + interrupt_signal();
  } catch (const Interrupted& interrupted) {
    log("interrupted\n");
    return 128 + interrupted.signal();
  } catch (const std::bad_alloc&) {
    write_log("offstage: out of memory\n");
    return kRunFailed;
  } catch (const std::exception&) {
    const Failure failure = describe_failure(std::current_exception());
    log("{}\n", failure.message);
    return failure.code;
  }
}

}  // namespace offstage::producer
