#include "render/confined_child.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"
#include "render/sandbox.h"
#include "scratch.h"

namespace offstage::render {
namespace {

/// Runs a job in the confined child, which may read `folder`, and returns its answer.
std::string answer_of(const std::filesystem::path& folder, const std::function<std::string()>& job) {
  const InputFolders folders({folder});
  const ChildAnswer answer = run_confined({.what = "test", .folders = &folders}, [&](int memory) {
    const std::string text = job();
    write_all(memory, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  });
  return {answer.bytes().begin(), answer.bytes().end()};
}

/// Things that a compromised job could try; returns the names of those that succeeded.
std::string harm(const std::filesystem::path& file, pid_t parent) {
  std::string done;
  const auto note = [&](const char* name, bool worked) { done += worked ? std::string(name) + " " : ""; };
  note("write", ::open(file.c_str(), O_WRONLY) >= 0);
  note("create", ::open((file.string() + ".new").c_str(), O_WRONLY | O_CREAT, 0600) >= 0);
  note("unlink", ::unlink(file.c_str()) == 0);
  note("rename", ::rename(file.c_str(), (file.string() + ".other").c_str()) == 0);
  note("chmod", ::chmod(file.c_str(), 0) == 0);
  note("socket", ::socket(AF_INET, SOCK_STREAM, 0) >= 0);
  note("kill", ::kill(parent, 0) == 0);
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  note("fork", child > 0);
  char* arguments[] = {const_cast<char*>("/bin/true"), nullptr};
  ::execv(arguments[0], arguments);  // would replace the child, which then sends no answer
  return done;
}

TEST(ConfinedChild, ReadsItsFolderAndDoesNoHarm) {
  ASSERT_NE(sandbox_support().find("seccomp"), std::string::npos) << sandbox_support();
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.put("in.txt", "precious");
  const pid_t parent = ::getpid();
  EXPECT_EQ(answer_of(scratch.path(), [&] { return read_text_file(file, 100); }), "precious");
  EXPECT_EQ(answer_of(scratch.path(), [&] { return harm(file, parent); }), "");
  EXPECT_EQ(read_text_file(file, 100), "precious");
}

TEST(ConfinedChild, OpensNoFileOfAnotherFolderWhereTheKernelHasLandlock) {
  const ScratchFolder scratch, other;
  const std::filesystem::path file = other.put("secret.txt", "secret");
  const auto reads = [&](const std::filesystem::path& folder) {
    return answer_of(folder, [&] { return ::open(file.c_str(), O_RDONLY) >= 0 ? "opened" : "refused"; });
  };
  const bool has_landlock = sandbox_support().find("Landlock") != std::string::npos;
  EXPECT_EQ(reads(other.path()), "opened");
  EXPECT_EQ(reads(scratch.path()), has_landlock ? "refused" : "opened");
}

TEST(ConfinedChild, InheritsNoDescriptor) {
  const ScratchFolder scratch;
  const Descriptor output(::open((scratch.path() / "out").c_str(), O_RDWR | O_CREAT, 0600));
  EXPECT_EQ(
      answer_of(scratch.path(), [&] { return ::write(output.fd(), "x", 1) == 1 ? "written" : "closed"; }),
      "closed");
}

TEST(ConfinedChild, FloodsAndCrashesAreErrorsOfTheFile) {
  const ScratchFolder scratch;
  const auto flood = [] {
    std::string text;
    text.resize(std::size_t{8} << 30, 'x');  // Clang 14 crashes if the constructor of a constant makes it
    return text;
  };
  const auto crash = []() -> std::string {
    ::raise(SIGSEGV);
    ::_exit(3);  // raise() was refused; this also ends the child
  };
  EXPECT_THROW(answer_of(scratch.path(), flood), FileError);
  EXPECT_THROW(answer_of(scratch.path(), crash), FileError);
}

TEST(ConfinedChild, AHangingJobIsEnded) {
  const ScratchFolder scratch;
  const InputFolders folders({scratch.path()});
  try {
    run_confined({.what = "test", .folders = &folders, .standstill = std::chrono::seconds(1)}, [](int) {
      const std::atomic<int> never{0};
      never.wait(0);
    });
    FAIL() << "the job ended by itself";
  } catch (const FileError& e) {
    EXPECT_NE(std::string(e.what()).find("no progress for 1 s"), std::string::npos) << e.what();
  }
}

TEST(ConfinedChild, ARequestToStopEndsIt) {
  const ScratchFolder scratch;
  const InputFolders folders({scratch.path()});
  EXPECT_THROW(run_confined({.what = "test", .folders = &folders, .stop = [] { return true; }},
                            [](int) {
                              while (true) ::sched_yield();
                            }),
               StoppedError);
}

}  // namespace
}  // namespace offstage::render
