// Decodes the answer of the confined reader with any bytes changed: it must be refused with a FileError, or
// give a consistent model. A hostile file may have taken over the reader, so its answer is not trusted. The
// reader itself is run by reader_fuzz.cpp.

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
