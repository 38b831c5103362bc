#pragma once

#include <memory>

#include "daemon/service/service.h"
#include "drivers/error.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {

/// A separate journal and a service without a cell: the prerequisites of an API.
struct WithoutHardware {
  TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
  SessionService service{
      {journal,
       dir.path(),
       [](const calib::Cell&, double, const std::string&) -> std::unique_ptr<Backend> {
         throw drivers::ConfigError("no hardware in this test");
       },
       {}}};
};

}  // namespace cellcal::daemon::testing
