// Any bytes as an STL file: refused with FileError, or read as valid triangles. Also
// replayed over stl_corpus as an ordinary test.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "calib/files/cell_file.h"
#include "calib/model/error.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Mesh mesh;
  try {
    mesh = parse_stl({reinterpret_cast<const char*>(data), size}, "fuzz.stl");
  } catch (const FileError&) {
    return 0;
  }
  require(!mesh.triangles.empty() && mesh.triangles.size() <= kMostTriangles, "a count");
  for (const auto& triangle : mesh.triangles)
    for (const int corner : triangle)
      require(corner >= 0 && static_cast<std::size_t>(corner) < mesh.vertices_m.size(),
              "corners are vertices");
  for (const auto& vertex : mesh.vertices_m)
    require(vertex.allFinite() && vertex.cwiseAbs().maxCoeff() <= 100.0, "vertices are near");
  return 0;
}
