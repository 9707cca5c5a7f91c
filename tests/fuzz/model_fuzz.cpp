// A model as the confined reader answers it, with any bytes changed: refused with a FileError, or a model
// that is consistent. A hostile file may have taken over the reader, so this is where it would reach the
// program. The reader itself is run by reader_fuzz.cpp.

#include <algorithm>
#include <cstdlib>

#include "render/error.h"
#include "render/mesh_import.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace offstage::render;
  try {
    Model model = decode_model({data, size});
    for (Model::Part& part : model.parts) {
      if (static_cast<std::size_t>(part.material) >= model.materials.size()) std::abort();
      compute_normals(part.mesh);
      for (const uint32_t index : part.mesh.indices)
        if (index >= part.mesh.positions.size()) std::abort();
    }
    if (model.bounds().isEmpty() != (model.vertex_count() == 0)) std::abort();
  } catch (const FileError&) {
  }
  return 0;
}
