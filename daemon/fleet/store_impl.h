#pragma once
// Within this module: what a Store holds.

#include "daemon/fleet/connection.h"
#include "daemon/fleet/store.h"

namespace cellcal::daemon::fleet {

struct Store::Impl {
  StoreConfig config;
  std::unique_ptr<pqxx::connection> connection;
};

}  // namespace cellcal::daemon::fleet
