// Full disks: a film that does not fit is an error and leaves no file that looks complete.

#include <filesystem>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <sys/mount.h>

#include "cli/program.h"
#include "faults/injection_count.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

/// A folder of limited capacity: a file system in memory. Without permission to mount one, the shell's
/// `ulimit -f` limits the size of each file instead, so writes fail at the same places.
class SmallDisk {
 public:
  SmallDisk(const fs::path& place, std::uintmax_t bytes) : place_(place) {
    fs::create_directories(place);
    const std::string size = "size=" + std::to_string((bytes + 4095) / 4096 * 4096);
    mounted_ = mount("none", place.c_str(), "tmpfs", 0, size.c_str()) == 0;
    constexpr std::uintmax_t kUnit = 512;  // unit of POSIX's ulimit
    if (!mounted_) limit_ = "ulimit -f " + std::to_string(bytes / kUnit) + ";";
  }
  ~SmallDisk() {
    if (mounted_) umount2(place_.c_str(), MNT_DETACH);
    std::error_code error;
    fs::remove_all(place_, error);  // the next disk starts empty
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  /// Returns shell text for the front of a command that writes to this disk.
  const std::string& limit() const { return limit_; }

 private:
  fs::path place_;
  std::string limit_;
  bool mounted_ = false;
};

/// Frames that are drawn once and then encoded to many disks, because drawing would take most of the time.
class FilmOnAFullDisk : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    drawn_ = std::make_unique<TemporaryFolder>();
    ASSERT_EQ(offstage("render " + tiny_scene() +
                           " -q --size 160x90 --duration 0.5 --quality draft --threads 2 -o frames/",
                       drawn_->path())
                  .code,
              0);
  }
  static void TearDownTestSuite() { drawn_.reset(); }

  Outcome encode(const fs::path& film, const std::string& limit = "") {
    return offstage("encode frames/ -q -o '" + film.string() + "'", drawn_->path(), limit);
  }

 private:
  static inline std::unique_ptr<TemporaryFolder> drawn_;
};

TEST_P(FilmOnAFullDisk, IsWholeOrAnErrorThatLeavesNothing) {
  const std::string film = std::string("film") + GetParam();
  const TemporaryFolder folder;
  ASSERT_EQ(encode(folder / film).code, 0);
  const std::string whole = read_file(folder / film);
  const int tries = tries_of(4);
  int failed = 0;
  for (int i = 0; i <= tries; ++i) {
    // The disks have from half of the film's size to all of it. Most of them have no room only for the last
    // part, and ffmpeg does not report its loss.
    const double fraction = i == 0 ? 0.5 : 0.9 + 0.2 * (i - 1) / std::max(tries - 1, 1);
    const SmallDisk disk(folder / "disk",
                         static_cast<std::uintmax_t>(fraction * static_cast<double>(whole.size())));
    const Outcome run = encode(folder / ("disk/" + film), disk.limit());
    const auto left = contents(folder / "disk");
    if (run.code == 0) {
      EXPECT_EQ(left.at(film), whole) << "fraction " << fraction;
    } else {
      ++failed;
      EXPECT_EQ(run.code, 1) << run.err;
      EXPECT_TRUE(left.empty()) << "fraction " << fraction << ": " << left.begin()->first;
    }
  }
  EXPECT_GT(failed, 0) << "half of the film's size is not enough";
}

INSTANTIATE_TEST_SUITE_P(Formats, FilmOnAFullDisk,
                         testing::Values(".mp4", ".mov", ".webm", ".mkv", ".gif", ".webp", ".apng"),
                         [](const auto& test) { return std::string(test.param).substr(1); });

}  // namespace
}  // namespace offstage::test
