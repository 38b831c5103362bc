#include "daemon/fleet/store/store_impl.h"

namespace cellcal::daemon::fleet {

namespace {

/// Certificates are large.
constexpr int kAtOnce = 8;

}  // namespace

std::vector<Kept> Store::kept(std::int64_t after) {
  std::vector<Kept> all;
  guarded([&] {
    pqxx::read_transaction work(*impl_->connection);
    for (
        const auto& row : work.exec_params(
            "SELECT id, plant, cell, topic, payload, bytes, octet_length(payload) = bytes FROM quarantine WHERE "
            "id > $1 AND why IN ('message', 'bound', 'database') ORDER BY id LIMIT $2",
            after, kAtOnce))
      all.push_back({row[0].as<std::int64_t>(),
                     {row[1].as<std::string>(), row[2].as<std::string>()},
                     row[3].as<std::string>(),
                     pqxx::binarystring(row[4]).str(),
                     row[5].as<std::int64_t>(),
                     row[6].as<bool>()});
  });
  return all;
}

void Store::let_go(std::int64_t kept) {
  guarded([&] {
    pqxx::work work(*impl_->connection);
    work.exec_params("DELETE FROM quarantine WHERE id = $1", kept);
    work.commit();
  });
}

}  // namespace cellcal::daemon::fleet
