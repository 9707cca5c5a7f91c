// Arbitrary bytes as the text of a scene: it is loaded or refused with a SceneError.

#include <string_view>

#include "producer/format/scene_io.h"
#include "render/error.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    offstage::producer::parse_scene({reinterpret_cast<const char*>(data), size}, "fuzz.json", "/nonexistent");
  } catch (const offstage::SceneError&) {
  }
  return 0;
}
