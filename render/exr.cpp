// The EXR files of channels.h and frame_files.h.

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
#include "render/file_io.h"
#include "render/frame_files.h"
#include "render/image_io.h"

namespace offstage::render {
namespace {

/// A file in memory, which is then written to the disk as a whole.
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

constexpr const char* kSettings = "offstage settings";

}  // namespace

void write_exr(const std::filesystem::path& path, const HdrImage& image, const std::string& settings) {
  constexpr float kLargest = 65504;  // of a half float
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
    return {};  // it is no EXR file
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
