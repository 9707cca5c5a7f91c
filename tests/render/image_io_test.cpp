#include "render/image_io.h"

#include <array>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "render/error.h"
#include "scratch.h"

namespace offstage::render {
namespace {

/// Returns a gradient with some structure; `alpha` is that of the first pixel.
Image test_image(int width, int height, uint8_t alpha = 255) {
  Image image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto byte = [](int v) { return static_cast<uint8_t>(v & 255); };
      image.rgba.insert(image.rgba.end(), {byte(3 * x), byte(5 * y), byte(x * y), uint8_t{255}});
    }
  }
  image.rgba[3] = alpha;
  image.transparent = alpha != 255;
  return image;
}

std::span<const uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

std::string big_endian(uint32_t v) {
  return {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
          static_cast<char>(v)};
}

TEST(EncodePng, ComesBackUnchanged) {
  for (const int alpha : {255, 0, 77}) {
    const Image image = test_image(37, 21, static_cast<uint8_t>(alpha));
    const Image back = decode_image(encode_png(image), "png");
    EXPECT_EQ(back.width_px, 37);
    EXPECT_EQ(back.height_px, 21);
    EXPECT_EQ(back.rgba, image.rgba);
  }
}

TEST(EncodePng, StoresAlphaIfTheImageIsMarkedTransparent) {
  constexpr std::size_t kColorType = 25;  // in the IHDR chunk: 2 is RGB, 6 is RGBA
  for (const uint8_t alpha : {uint8_t{255}, uint8_t{254}}) {
    Image image = test_image(4, 4, alpha);
    image.transparent = false;
    EXPECT_EQ(encode_png(image).at(kColorType), 2);
    image.transparent = true;
    EXPECT_EQ(encode_png(image).at(kColorType), 6);
    EXPECT_TRUE(decode_image(encode_png(image), "image").transparent);
  }
}

TEST(EncodePng, RefusesPixelsThatDoNotFillTheImage) {
  EXPECT_THROW(encode_png(Image{2, 2, std::vector<uint8_t>(15)}), std::invalid_argument);
  EXPECT_THROW(encode_png(Image{}), std::invalid_argument);
}

TEST(DecodeImage, WidensGreyAndNarrowsSixteenBits) {
  const Image grey = decode_image(bytes_of(std::string("P5 2 1 255\n") + '\x40' + '\xff'), "grey");
  EXPECT_EQ(grey.rgba, (std::vector<uint8_t>{0x40, 0x40, 0x40, 255, 255, 255, 255, 255}));
  const std::vector<uint8_t> deep_grey = {
      // a PNG of two pixels, 0x8012 and 0xffff
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
      0x44, 0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x10, 0x00, 0x00, 0x00,
      0x00, 0x81, 0xd9, 0xfc, 0x15, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x44, 0x41, 0x54, 0x78,
      0xda, 0x63, 0x68, 0x10, 0xfa, 0xff, 0x1f, 0x00, 0x05, 0x38, 0x02, 0x91, 0x15, 0xc8,
      0xbd, 0xe4, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  EXPECT_EQ(decode_image(deep_grey, "deep").rgba,
            (std::vector<uint8_t>{0x80, 0x80, 0x80, 255, 255, 255, 255, 255}));
}

TEST(DecodeImage, NamesUnreadableFiles) {
  const std::vector<uint8_t> png = encode_png(test_image(64, 64));
  const std::span<const uint8_t> half(png.data(), png.size() / 2);
  const std::string text("no picture"), deep_pnm("P5 1 1 65535\n\x80\x12");
  const std::array<std::span<const uint8_t>, 4> all = {std::span<const uint8_t>{}, bytes_of(text),
                                                       bytes_of(deep_pnm), half};
  for (const std::span<const uint8_t> bytes : all) {
    const std::string message = message_of<FileError>([&] { decode_image(bytes, "some.png"); });
    EXPECT_EQ(message.find("some.png: cannot be read as an image: "), 0u) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

TEST(DecodeImage, RefusesMoreThan16384PixelsASideBeforeItAllocates) {
  const std::string header = std::string("\x89PNG\r\n\x1a\n") + big_endian(13) + "IHDR" + big_endian(20000) +
                             big_endian(10) + std::string("\x08\x06\0\0\0", 5) + big_endian(0) +
                             big_endian(1) + "IDAT";
  const std::string message = message_of<FileError>([&] { decode_image(bytes_of(header), "big"); });
  EXPECT_NE(message.find("20000x10"), std::string::npos) << message;
}

TEST(ReadImage, DistinguishesAMissingFileFromAFolder) {
  const ScratchFolder folder;
  EXPECT_NE(message_of<FileError>([&] { read_image(folder / "none.png"); }).find("No such file"),
            std::string::npos);
  EXPECT_NE(message_of<FileError>([&] { read_image(folder.path()); }).find("not a regular file"),
            std::string::npos);
}

TEST(WriteFileAtomically, ReplacesTheOldFileAndLeavesNothingElse) {
  const ScratchFolder folder;
  folder.put("a.bin", "old and longer");
  write_file_atomically(folder / "a.bin", bytes_of("new"));
  EXPECT_EQ(file_content(folder / "a.bin"), "new");
  EXPECT_EQ(folder.names(), std::set<std::string>{"a.bin"});
}

TEST(WriteFileAtomically, AcceptsTheLongestFileName) {
  const ScratchFolder folder;
  const std::string name(255, 'x');
  write_file_atomically(folder / name, bytes_of("content"));
  EXPECT_EQ(file_content(folder / name), "content");
}

TEST(WriteFileAtomically, SaysWhyAFolderIsRefused) {
  const ScratchFolder folder;
  folder.put("file", "");
  const auto message = [&](const char* name) {
    return message_of<FileError>([&] { write_file_atomically(folder / name, {}); });
  };
  EXPECT_NE(message("none/a").find("No such file or directory"), std::string::npos);
  EXPECT_NE(message("file/a").find("Not a directory"), std::string::npos);
  EXPECT_EQ(folder.names(), std::set<std::string>{"file"});
}

TEST(WriteFileAtomically, KeepsTheOldFileWhenTheDiskIsFull) {
  const ScratchFolder folder;
  folder.put("a.bin", "old");
  const int status = status_of_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const std::vector<uint8_t> bytes(100000);
    return message_of<FileError>([&] {
             write_file_atomically(folder / "a.bin", bytes);
           }).find("File too large") != std::string::npos;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(file_content(folder / "a.bin"), "old");
  EXPECT_EQ(folder.names(), std::set<std::string>{"a.bin"});
}

TEST(WriteFileAtomically, WritesToADeviceInsteadOfReplacingIt) {
  const std::string message =
      message_of<FileError>([] { write_file_atomically("/dev/full", bytes_of("x")); });
  EXPECT_EQ(message, "/dev/full: cannot be written: No space left on device");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace offstage::render
