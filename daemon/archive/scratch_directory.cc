#include "daemon/archive/scratch_directory.h"

#include <stdlib.h>

#include <string>

#include "daemon/archive/archive.h"

namespace cellcal::daemon {

ScratchDirectory::ScratchDirectory() {
  std::string name = (std::filesystem::temp_directory_path() / "cellcal-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw ArchiveError(name + ": no directory can be made. Set TMPDIR to one that can be written");
  path_ = name;
}

ScratchDirectory::~ScratchDirectory() {
  std::error_code ignored;  // left behind in a directory of temporary files
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace cellcal::daemon
