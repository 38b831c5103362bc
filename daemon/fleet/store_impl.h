#pragma once
// Internal to this module: members of a Store.

#include "daemon/fleet/connection.h"
#include "daemon/fleet/store.h"

namespace cellcal::daemon::fleet {

struct Store::Impl {
  StoreConfig config;
  std::unique_ptr<pqxx::connection> connection;
};

}  // namespace cellcal::daemon::fleet
