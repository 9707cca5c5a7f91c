#include "render/sink.h"

#include <cmath>
#include <sstream>

#include <ImfRgbaFile.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include "render/error.h"
#include "render/frame_files.h"
#include "render/image_io.h"
#include "scratch.h"

namespace offstage::render {
namespace {

Image flat(int width, int height, std::array<uint8_t, 4> color) {
  Image image{width, height, {}};
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    image.rgba.insert(image.rgba.end(), color.begin(), color.end());
  return image;
}

/// Returns a picture with sixteen grey columns, which move by one column per frame.
Image greys(int width, int height, int frame) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    const auto grey = static_cast<uint8_t>(17 * ((i % width * 16 / width + frame) % 16));
    image.rgba.insert(image.rgba.end(), {grey, grey, grey, 255});
  }
  return image;
}

void film(const VideoDef& def, int frames) {
  const auto sink = make_video_sink(def);
  for (int f = 0; f < frames; ++f) sink->write(f, greys(def.width_px, def.height_px, f));
  sink->close();
}

/// Sets an environment variable during its lifetime.
class EnvironmentVariable {
 public:
  EnvironmentVariable(const char* name, const std::string& value) : name_(name) {
    ::setenv(name, value.c_str(), 1);
  }
  ~EnvironmentVariable() { ::unsetenv(name_); }
  EnvironmentVariable(const EnvironmentVariable&) = delete;
  EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;

 private:
  const char* name_;
};

/// Returns a replacement for ffmpeg that lists the real encoders, and otherwise runs the shell code `body`.
std::filesystem::path fake_ffmpeg(const ScratchFolder& folder, const std::string& body) {
  const auto path = folder.put(
      "fake-ffmpeg", "#!/bin/sh\ncase \"$*\" in *-encoders*) exec ffmpeg -encoders;; esac\n" + body);
  ::chmod(path.c_str(), 0755);
  return path;
}

TEST(FramePath, PutsTheNumberInTheHashes) {
  EXPECT_EQ(frame_path("out/####.png", 7), "out/0007.png");
  EXPECT_EQ(frame_path("out/shot#2_##.png", 123), "out/shot#2_123.png");
  EXPECT_EQ(frame_path("#.png", 10), "10.png");
  EXPECT_EQ(frame_path("a####.png", -12), "a-012.png");
  EXPECT_EQ(frame_path("take#1/f###.png", 5), "take#1/f005.png");
  EXPECT_THROW(frame_path("take#1/frame.png", 5), std::invalid_argument);
}

TEST(PngSink, MakesItsFoldersAndOneFileAFrame) {
  const ScratchFolder folder;
  const auto sink = make_frame_sink(folder / "a/b/f###.png");
  sink->write(1, flat(3, 2, {1, 2, 3, 255}));
  sink->write(12, flat(3, 2, {4, 5, 6, 255}));
  sink->close();
  EXPECT_EQ(read_image(folder / "a/b/f001.png").rgba, flat(3, 2, {1, 2, 3, 255}).rgba);
  EXPECT_EQ(read_image(folder / "a/b/f012.png").rgba, flat(3, 2, {4, 5, 6, 255}).rgba);
}

/// Returns a picture whose left half is `a` and whose right half is `b`.
HdrImage two_lights(float a, float b) {
  HdrImage image{32, 16, {}};
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const float value = i % 32 < 16 ? a : b;
    image.rgba.insert(image.rgba.end(), {value, value / 2, 0, 1});
  }
  return image;
}

TEST(FrameFiles, AJpegIsClosestToItsPictureAndKnowsItsFilm) {
  const ScratchFolder folder;
  const auto sink = make_frame_sink(folder / "f#.jpg", "0123abcd");
  const Image picture = flat(40, 24, {200, 30, 90, 255});
  sink->write(1, picture);
  sink->close();
  const Image read = read_image(folder / "f1.jpg");
  EXPECT_LE(difference(read, picture).max_delta, 3);
  const auto file = inspect_frame(folder / "f1.jpg");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->width_px, 40);
  EXPECT_EQ(file->height_px, 24);
  EXPECT_EQ(file->settings, "0123abcd");
  std::filesystem::resize_file(folder / "f1.jpg", std::filesystem::file_size(folder / "f1.jpg") - 2);
  EXPECT_FALSE(inspect_frame(folder / "f1.jpg")) << "it is cut short";
}

TEST(FrameFiles, AnExrHoldsLightBeyondWhite) {
  const ScratchFolder folder;
  const auto sink = make_frame_sink(folder / "f#.exr", "0123abcd");
  ASSERT_TRUE(sink->needs_linear());
  sink->write(1, flat(32, 16, {0, 0, 0, 255}));
  sink->write_linear(1, two_lights(12.5f, 1e9f));
  sink->close();
  Imf::RgbaInputFile file((folder / "f1.exr").c_str());
  std::vector<Imf::Rgba> pixels(32 * 16);
  file.setFrameBuffer(pixels.data(), 1, 32);
  file.readPixels(0, 15);
  EXPECT_FLOAT_EQ(pixels[0].r, 12.5f);
  EXPECT_FLOAT_EQ(pixels[0].g, 6.25f);
  EXPECT_FLOAT_EQ(pixels[31].r, 65504) << "the largest half float, not infinity";
  const auto info = inspect_frame(folder / "f1.exr");
  ASSERT_TRUE(info);
  EXPECT_EQ(info->width_px, 32);
  EXPECT_FALSE(info->alpha);
  EXPECT_EQ(info->settings, "0123abcd");
}

class VideoSinkFormat : public testing::TestWithParam<const char*> {};

TEST_P(VideoSinkFormat, HoldsEveryFrameAtItsSizeAndOnlyUnderItsNameOnceClosed) {
  const ScratchFolder folder;
  const std::string name = std::string("film") + GetParam();
  const auto sink = make_video_sink({.path = folder / name, .width_px = 64, .height_px = 48, .fps = 25});
  for (int f = 0; f < 12; ++f) sink->write(f, greys(64, 48, f));
  EXPECT_FALSE(std::filesystem::exists(folder / name));
  sink->close();
  EXPECT_EQ(folder.names(), std::set<std::string>{name});
  const std::string file = (folder / name).string();
  if (name == "film.webp") {  // ffprobe does not read animated WebP; its frames are ANMF chunks
    const std::string content = file_content(file);
    int frames = 0;
    for (std::size_t at = content.find("ANMF"); at != std::string::npos; at = content.find("ANMF", at + 1))
      ++frames;
    EXPECT_EQ(frames, 12);
    return;
  }
  EXPECT_EQ(output_of("ffprobe -v error -count_frames -select_streams v:0 -show_entries "
                      "stream=width,height,nb_read_frames -of csv=p=0 " +
                      file),
            "64,48,12\n");
}
INSTANTIATE_TEST_SUITE_P(All, VideoSinkFormat,
                         testing::Values(".mp4", ".webm", ".mov", ".mkv", ".gif", ".webp", ".apng", ".png"));

TEST(VideoSink, KnownGreysComeBackThroughMp4AndAreTagged) {
  const ScratchFolder folder;
  const VideoDef def{.path = folder / "greys.mp4", .width_px = 256, .height_px = 64, .fps = 30};
  film(def, 3);
  const std::string raw =
      output_of("ffmpeg -v error -i " + def.path.string() + " -f rawvideo -pix_fmt rgb24 -");
  ASSERT_EQ(raw.size(), 3u * 256 * 64 * 3);
  for (int f = 0; f < 3; ++f) {
    // the middle of each column, away from the ringing at its edges
    for (int column = 0; column < 16; ++column) {
      const auto at = static_cast<std::size_t>((f * 64 + 32) * 256 + column * 16 + 8) * 3;
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(static_cast<uint8_t>(raw[at + c]), 17 * ((column + f) % 16), 2);
      }
    }
  }
  EXPECT_EQ(output_of("ffprobe -v error -show_entries stream=pix_fmt,color_range,color_space,color_transfer,"
                      "color_primaries -of csv=p=0 " +
                      def.path.string()),
            "yuv420p,tv,bt709,iec61966-2-1,bt709\n");
}

TEST(VideoSink, KeepsAlphaExactlyInAnimatedPng) {
  const ScratchFolder folder;
  const VideoDef def{.path = folder / "a.png", .width_px = 5, .height_px = 3, .fps = 30, .alpha = true};
  const auto sink = make_video_sink(def);
  const Image first = flat(5, 3, {200, 100, 50, 128});
  sink->write(0, first);
  sink->write(1, flat(5, 3, {0, 0, 0, 0}));
  sink->close();
  const std::string raw = output_of("ffmpeg -v error -f apng -i " + def.path.string() +
                                    " -fps_mode passthrough -f rawvideo -pix_fmt rgba -");
  ASSERT_EQ(raw.size(), 2 * first.rgba.size());
  EXPECT_TRUE(std::equal(first.rgba.begin(), first.rgba.end(), reinterpret_cast<const uint8_t*>(raw.data())));
}

TEST(VideoSink, KeepsAlphaInProResAndVp9) {
  const ScratchFolder folder;
  for (const std::string name : {"a.mov", "a.webm"}) {
    const VideoDef def{.path = folder / name, .width_px = 64, .height_px = 64, .fps = 30, .alpha = true};
    const auto sink = make_video_sink(def);
    for (int f = 0; f < 3; ++f) sink->write(f, flat(64, 64, {200, 200, 200, 128}));
    sink->close();
    const std::string decoder = name == "a.webm" ? "-c:v libvpx-vp9 " : "";
    const std::string raw = output_of("ffmpeg -v error " + decoder + "-i " + def.path.string() +
                                      " -frames:v 1 -f rawvideo -pix_fmt rgba -");
    ASSERT_EQ(raw.size(), 64u * 64 * 4) << name;
    EXPECT_NEAR(static_cast<uint8_t>(raw[4 * 2080]), 200, 3) << name;
    EXPECT_NEAR(static_cast<uint8_t>(raw[4 * 2080 + 3]), 128, 3) << name;
  }
}

TEST(VideoSink, AFilmMayHaveOneFrame) {
  const ScratchFolder folder;
  for (const std::string extension : {".mp4", ".webm", ".mov", ".mkv", ".gif", ".webp", ".apng", ".png"}) {
    EXPECT_NO_THROW(film({.path = folder / ("one" + extension), .width_px = 64, .height_px = 48}, 1))
        << extension;
    EXPECT_TRUE(std::filesystem::exists(folder / ("one" + extension))) << extension;
  }
}

TEST(VideoSink, TheSameFramesGiveTheSameFile) {
  const ScratchFolder folder;
  for (const std::string extension : {".mp4", ".webm", ".mov", ".apng"}) {
    for (const char* name : {"a", "b"})
      film({.path = folder / (name + extension), .width_px = 160, .height_px = 90}, 20);
    EXPECT_EQ(file_content(folder / ("a" + extension)), file_content(folder / ("b" + extension)))
        << extension;
  }
}

TEST(VideoSink, DiscardsPartialFilesWithoutClose) {
  const ScratchFolder folder;
  {
    const auto sink = make_video_sink({.path = folder / "a.mp4", .width_px = 32, .height_px = 32});
    sink->write(0, greys(32, 32, 0));
    const std::set<std::string> names = folder.names();
    ASSERT_EQ(names.size(), 1u);
    EXPECT_TRUE(names.begin()->starts_with(".offstage-")) << *names.begin();
  }
  EXPECT_EQ(folder.names(), std::set<std::string>{});
}

TEST(VideoSink, ShowsTheLastMessagesOfAKilledEncoder) {
  const ScratchFolder folder;
  const EnvironmentVariable ffmpeg("OFFSTAGE_FFMPEG",
                                   fake_ffmpeg(folder,
                                               "head -c 5000 >/dev/null\n"
                                               "printf 'out of paint\\nreally' >&2\nkill -9 $$\n"));
  const std::string message = message_of<FileError>([&] {
    const auto sink = make_video_sink({.path = folder / "a.mp4", .width_px = 640, .height_px = 480});
    for (int f = 0; f < 10; ++f) sink->write(f, greys(640, 480, f));
  });
  EXPECT_NE(message.find("a.mp4: ffmpeg (libx264) ended early with signal 9"), std::string::npos) << message;
  EXPECT_NE(message.find("out of paint; really"), std::string::npos) << message;
  EXPECT_EQ(folder.names(), std::set<std::string>{"fake-ffmpeg"});
}

TEST(VideoSink, ReportsAnEncoderThatFailsAtTheEnd) {
  const ScratchFolder folder;
  const EnvironmentVariable ffmpeg("OFFSTAGE_FFMPEG",
                                   fake_ffmpeg(folder, "cat >/dev/null; echo no space >&2; exit 3\n"));
  const auto sink = make_video_sink({.path = folder / "a.mp4", .width_px = 32, .height_px = 32});
  sink->write(0, greys(32, 32, 0));
  const std::string message = message_of<FileError>([&] { sink->close(); });
  EXPECT_NE(message.find("exit code 3: no space"), std::string::npos) << message;
}

TEST(VideoSink, RunsTheEncoderInItsOwnProcessGroup) {
  const ScratchFolder folder;
  const auto report = folder / "group";
  const EnvironmentVariable ffmpeg(
      "OFFSTAGE_FFMPEG",
      fake_ffmpeg(folder, "cut -d' ' -f5 /proc/$$/stat >" + report.string() + "; cat >/dev/null\n"));
  const auto sink = make_video_sink({.path = folder / "a.mp4", .width_px = 32, .height_px = 32});
  sink->write(0, greys(32, 32, 0));
  EXPECT_THROW(sink->close(), FileError) << "exit code 0 of ffmpeg without a film is a failure";
  const int group = std::stoi(file_content(report));
  EXPECT_GT(group, 0);
  EXPECT_NE(group, ::getpgrp());
}

TEST(VideoSink, NeedsAFolderItCanWriteToAndAFrame) {
  const ScratchFolder folder;
  folder.put("file", "");
  EXPECT_THROW(make_video_sink({.path = folder / "file/a.mp4", .width_px = 32, .height_px = 32}), FileError);
  const auto sink = make_video_sink({.path = folder / "a.mp4", .width_px = 32, .height_px = 32});
  EXPECT_THROW(sink->write(0, greys(16, 16, 0)), std::invalid_argument);
  EXPECT_THROW(sink->close(), FileError);
}

TEST(CheckVideo, NamesThePackageOfAMissingFfmpeg) {
  const EnvironmentVariable ffmpeg("OFFSTAGE_FFMPEG", "/nonexistent");
  const std::string message =
      message_of<UnavailableError>([] { check_video({.path = "a.mp4", .width_px = 32, .height_px = 32}); });
  EXPECT_NE(message.find("'/nonexistent' (No such file or directory)"), std::string::npos) << message;
  EXPECT_NE(message.find("Debian package ffmpeg"), std::string::npos) << message;
  EXPECT_TRUE(available_encoders().empty());
}

TEST(CheckVideo, NamesAMissingEncoder) {
  const ScratchFolder folder;
  const auto script = folder.put("poor-ffmpeg", "#!/bin/sh\necho ' V....D gif   GIF'\n");
  ::chmod(script.c_str(), 0755);
  const EnvironmentVariable ffmpeg("OFFSTAGE_FFMPEG", script);
  EXPECT_EQ(available_encoders(), std::vector<std::string>{"gif"});
  EXPECT_NO_THROW(check_video({.path = "a.gif", .width_px = 32, .height_px = 32, .fps = 25}));
  const std::string message =
      message_of<UnavailableError>([] { check_video({.path = "a.webm", .width_px = 32, .height_px = 32}); });
  EXPECT_NE(message.find("libvpx-vp9"), std::string::npos) << message;
}

TEST(CheckVideo, RefusesUnsupportedSettingsOfAFormatWithAdvice) {
  const auto advice = [](const VideoDef& def) {
    return message_of<std::invalid_argument>([&] { check_video(def); });
  };
  EXPECT_NE(advice({.path = "a.mp4", .width_px = 641, .height_px = 359}).find("use 642x360"),
            std::string::npos);
  EXPECT_NE(advice({.path = "a.mp4", .width_px = 64, .height_px = 48, .alpha = true}).find("transparency"),
            std::string::npos);
  EXPECT_NE(advice({.path = "a.gif", .width_px = 64, .height_px = 48, .fps = 60}).find("(0, 50]"),
            std::string::npos);
  EXPECT_NE(advice({.path = "a.avi", .width_px = 64, .height_px = 48}).find(".mp4 .webm"), std::string::npos);
  EXPECT_NE(advice({.path = "a.mp4", .width_px = 0, .height_px = 48}), "");
  EXPECT_NE(advice({.path = "a.mp4", .width_px = 64, .height_px = 48, .fps = {0, 1}}), "");
  EXPECT_EQ(advice({.path = "a.mov", .width_px = 65, .height_px = 49, .alpha = true}), "");
}

/// Returns the bytes that a pipe sink writes to standard output for two frames.
std::string piped(bool y4m, const Image& image) {
  const ScratchFolder folder;
  const std::string file = (folder / "out").string();
  const int status = status_of_child([&] {
    ::dup2(::open(file.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    const auto sink = make_pipe_sink(y4m, image.width_px, image.height_px, {30000, 1001});
    sink->write(0, image);
    sink->write(1, image);
    sink->close();
    return true;
  });
  EXPECT_EQ(status, 0);
  return file_content(file);
}

TEST(PipeSink, WritesRawFramesAsTheyAre) {
  const std::string pixels = "\x01\x02\x03\x04\x05\x06\x07\x08";
  const Image image{2, 1, {1, 2, 3, 4, 5, 6, 7, 8}};
  EXPECT_EQ(piped(false, image), pixels + pixels);
}

TEST(PipeSink, WritesYuv4mpegInLimitedBt709) {
  const Image image{4, 1, {0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 255, 0, 0, 255, 255}};
  // Black, white, red, blue: Y = 16 + 219 (0.2126 R + 0.7152 G + 0.0722 B), Cb = 128 + 112 (B - Y) / 0.9278,
  // Cr = 128 + 112 (R - Y) / 0.7874.
  const std::string frame =
      std::string("FRAME\n") + "\x10\xeb\x3f\x20" + "\x80\x80\x66\xf0" + "\x80\x80\xf0\x76";
  EXPECT_EQ(piped(true, image),
            "YUV4MPEG2 W4 H1 F30000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\n" + frame + frame);
}

TEST(PipeSink, AClosedPipeIsAnErrorAndNotASignal) {
  const int status = status_of_child([] {
    ::signal(SIGPIPE, SIG_DFL);
    int ends[2];
    if (::pipe(ends) != 0) return false;
    ::dup2(ends[1], STDOUT_FILENO);
    ::close(ends[0]);
    const auto sink = make_pipe_sink(false, 2, 1, 30);
    const bool thrown = !message_of<FileError>([&] {
                           sink->write(0, Image{2, 1, std::vector<uint8_t>(8)});
                         }).empty();
    sigset_t pending, blocked;
    ::sigpending(&pending);
    ::pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
    return thrown && !sigismember(&pending, SIGPIPE) && !sigismember(&blocked, SIGPIPE);
  });
  EXPECT_EQ(status, 0);
}

TEST(PipeSink, RefusesATerminal) {
  const int status = status_of_child([] {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) return false;
    ::dup2(::open(::ptsname(master), O_RDWR | O_NOCTTY), STDOUT_FILENO);
    return !message_of<std::invalid_argument>([] { make_pipe_sink(false, 2, 1, 30); }).empty();
  });
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace offstage::render
