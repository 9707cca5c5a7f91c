#include <stdexcept>

#include "render/file_io.h"
#include "render/image_io.h"
#include "render/sink.h"

namespace offstage::render {
namespace {

class PngSink final : public FrameSink {
 public:
  PngSink(const std::filesystem::path& pattern, const std::string& settings)
      : pattern_(pattern), settings_(settings) {
    create_parent_folders(frame_path(pattern, 0));
  }
  void write(int frame, const Image& image) override {
    write_png(frame_path(pattern_, frame), image, settings_);
  }
  void close() override {}

 private:
  std::filesystem::path pattern_;
  std::string settings_;
};

}  // namespace

std::filesystem::path frame_path(const std::filesystem::path& pattern, int frame) {
  std::string name = pattern.filename().string();
  const std::size_t last = name.find_last_of('#');
  if (last == std::string::npos) {
    throw std::invalid_argument(pattern.string() + ": has no place for the frame number; write it as '####'");
  }
  const std::size_t before = name.find_last_not_of('#', last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  const std::size_t width = last - first + 1;

  const std::string sign = frame < 0 ? "-" : "";
  std::string digits = std::to_string(frame).substr(sign.size());
  if (digits.size() + sign.size() < width) digits.insert(0, width - digits.size() - sign.size(), '0');
  name.replace(first, width, sign + digits);
  return pattern.parent_path() / name;
}

std::unique_ptr<FrameSink> make_png_sink(const std::filesystem::path& pattern, const std::string& settings) {
  return std::make_unique<PngSink>(pattern, settings);
}

}  // namespace offstage::render
