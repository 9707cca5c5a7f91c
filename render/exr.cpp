// Reads and writes EXR files: implements functions of channels.h, frame_files.h and exr.h.

#include "render/exr.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <vector>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include "render/channels.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/frame_files.h"
#include "render/image_io.h"

namespace offstage::render {
namespace {

/// An output file in memory, which is then written to the disk as a whole.
class Buffer : public Imf::OStream {
 public:
  Buffer() : Imf::OStream("memory") {}
  void write(const char c[], int n) override {
    const auto size = static_cast<std::size_t>(n);
    if (bytes.size() < at_ + size) bytes.resize(at_ + size);
    std::memcpy(bytes.data() + at_, c, size);
    at_ += size;
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t place) override { at_ = place; }

  std::vector<uint8_t> bytes;

 private:
  std::size_t at_ = 0;
};

/// An input file whose bytes are in memory.
class Bytes : public Imf::IStream {
 public:
  explicit Bytes(std::span<const uint8_t> bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char c[], int n) override {
    const auto size = static_cast<std::size_t>(n);
    if (at_ > bytes_.size() || size > bytes_.size() - at_)
      throw std::runtime_error("the file ends too early");
    std::memcpy(c, bytes_.data() + at_, size);
    at_ += size;
    return at_ < bytes_.size();
  }
  uint64_t tellg() override { return at_; }
  void seekg(uint64_t place) override { at_ = place; }

 private:
  std::span<const uint8_t> bytes_;
  std::size_t at_ = 0;
};

HdrImage decode_rgb(std::span<const uint8_t> bytes, uint64_t max_pixels) {
  constexpr int kMostSide = 16384;
  Bytes stream(bytes);
  Imf::InputFile file(stream, 0);
  const Imath::Box2i window = file.header().dataWindow();
  const int64_t width = int64_t{window.max.x} - window.min.x + 1,
                height = int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1 || width > kMostSide || height > kMostSide ||
      static_cast<uint64_t>(width * height) > max_pixels)
    throw std::runtime_error("it has " + std::to_string(width) + "x" + std::to_string(height) +
                             " pixels; at most " + std::to_string(max_pixels >> 20) + " Mi pixels and " +
                             std::to_string(kMostSide) + " per side are possible");
  const Imf::ChannelList& channels = file.header().channels();
  const bool grey = channels.findChannel("R") == nullptr;
  const char* names[] = {grey ? "Y" : "R", grey ? "Y" : "G", grey ? "Y" : "B"};
  HdrImage image{static_cast<int>(width), static_cast<int>(height), {}};
  image.rgba.assign(image.pixel_count() * 4, 1.0f);
  Imf::FrameBuffer pixels;
  const std::size_t stride = 4 * sizeof(float), row = stride * static_cast<std::size_t>(width);
  for (std::size_t c = 0; c < (grey ? 1u : 3u); ++c) {
    const Imf::Channel* channel = channels.findChannel(names[c]);
    if (channel == nullptr || channel->xSampling != 1 || channel->ySampling != 1)
      throw std::runtime_error("it has no channels R, G and B of full resolution, and no Y");
    // The library counts pixels from the origin of the display window.
    auto* base = reinterpret_cast<char*>(image.rgba.data() + c);
    base -=
        static_cast<std::ptrdiff_t>(stride) * window.min.x + static_cast<std::ptrdiff_t>(row) * window.min.y;
    pixels.insert(names[c], Imf::Slice(Imf::FLOAT, base, stride, row));
  }
  file.setFrameBuffer(pixels);
  file.readPixels(window.min.y, window.max.y);
  for (std::size_t i = 0; grey && i < image.rgba.size(); i += 4)
    image.rgba[i + 1] = image.rgba[i + 2] = image.rgba[i];
  return image;
}

constexpr const char* kSettings = "offstage settings";

}  // namespace

HdrImage decode_exr(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  try {
    return decode_rgb(bytes, max_pixels);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw FileError(name + ": cannot be read as an image: " + one_line(error.what()));
  }
}

void write_exr(const std::filesystem::path& path, const HdrImage& image, const std::string& settings) {
  constexpr float kLargest = 65504;  // the largest half float
  const std::size_t channels = image.transparent ? 4 : 3;
  std::vector<half> values(image.pixel_count() * channels);
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    for (std::size_t c = 0; c < channels; ++c)
      values[i * channels + c] = half(std::clamp(image.rgba[4 * i + c], -kLargest, kLargest));

  Imf::Header header(image.width_px, image.height_px);
  header.compression() = Imf::ZIP_COMPRESSION;
  if (!settings.empty()) header.insert(kSettings, Imf::StringAttribute(settings));
  Imf::FrameBuffer pixels;
  const char* names[] = {"R", "G", "B", "A"};
  for (std::size_t c = 0; c < channels; ++c) {
    header.channels().insert(names[c], Imf::Channel(Imf::HALF));
    const std::size_t stride = channels * sizeof(half);
    pixels.insert(names[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(values.data() + c), stride,
                                       stride * static_cast<std::size_t>(image.width_px)));
  }
  Buffer buffer;
  {
    constexpr int kNoThreads = 0;
    Imf::OutputFile file(buffer, header, kNoThreads);
    file.setFrameBuffer(pixels);
    file.writePixels(image.height_px);
  }
  write_file_atomically(path, buffer.bytes);
}

std::optional<FrameFile> inspect_exr(const std::filesystem::path& path) {
  try {
    const Imf::InputFile file(path.c_str(), 0);
    if (!file.isComplete()) return {};
    const Imath::Box2i window = file.header().dataWindow();
    const auto* settings = file.header().findTypedAttribute<Imf::StringAttribute>(kSettings);
    return FrameFile{window.max.x - window.min.x + 1, window.max.y - window.min.y + 1,
                     file.header().channels().findChannel("A") != nullptr, settings ? settings->value() : ""};
  } catch (const std::exception&) {
    return {};  // the file is not an EXR file
  }
}

void write_exr(const std::filesystem::path& path, const Channels& channels, const ChannelChoice& choice,
               const ObjectNames& objects) {
  Imf::Header header(channels.width_px, channels.height_px);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer pixels;
  const auto add = [&](const char* name, Imf::PixelType type, const void* first, std::size_t stride) {
    header.channels().insert(name, Imf::Channel(type));
    // The library takes a non-const pointer, but only reads.
    auto* base = static_cast<char*>(const_cast<void*>(first));
    pixels.insert(name, Imf::Slice(type, base, stride, stride * static_cast<std::size_t>(channels.width_px)));
  };
  if (choice.has(Channel::depth)) add("Z", Imf::FLOAT, channels.depth.data(), sizeof(float));
  if (choice.has(Channel::normal)) {
    const char* names[] = {"N.X", "N.Y", "N.Z"};
    for (int k = 0; k < 3; ++k)
      add(names[k], Imf::FLOAT, channels.normal.data()->data() + k, sizeof(Eigen::Vector3f));
  }
  if (choice.has(Channel::id)) {
    add("id", Imf::UINT, channels.id.data(), sizeof(uint32_t));
    std::string text;
    for (const auto& [id, name] : objects) text += std::to_string(id) + " " + name + "\n";
    header.insert("objects", Imf::StringAttribute(text));
  }
  if (choice.has(Channel::motion)) {
    const char* names[] = {"motion.X", "motion.Y"};
    for (int k = 0; k < 2; ++k)
      add(names[k], Imf::FLOAT, channels.motion.data()->data() + k, sizeof(Eigen::Vector2f));
  }
  Buffer buffer;
  {
    constexpr int kNoThreads = 0;
    Imf::OutputFile file(buffer, header, kNoThreads);
    file.setFrameBuffer(pixels);
    file.writePixels(channels.height_px);
  }
  write_file_atomically(path, buffer.bytes);
}

}  // namespace offstage::render
