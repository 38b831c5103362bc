#include "daemon/fleet/store/connection.h"

namespace cellcal::daemon::fleet {

namespace {

/// Classes of SQLSTATE that are the values' own fault: data exception, integrity constraint, program limit.
bool is_data(const std::string& state) {
  return state.starts_with("22") || state.starts_with("23") || state.starts_with("54");
}

/// A database whose computer has gone without a word is noticed within half a minute. What the owner states counts.
std::string with_time_limits(const std::string& connection) {
  const std::string limits =
      "connect_timeout=10 keepalives_idle=10 keepalives_interval=5 keepalives_count=3 tcp_user_timeout=30000 ";
  if (connection.starts_with("postgresql://") || connection.starts_with("postgres://"))
    return connection;
  return limits + connection;
}

std::string first_line(const std::string& words) { return words.substr(0, words.find('\n')); }

}  // namespace

void guarded(const std::function<void()>& work) {
  try {
    work();
  } catch (const pqxx::sql_error& error) {
    if (is_data(error.sqlstate())) throw BadData(first_line(error.what()));
    throw StoreAway(first_line(error.what()));
  } catch (
      const pqxx::failure& error) {  // also in_doubt_error: nobody knows whether it was committed
    throw StoreAway(first_line(error.what()));
  }
}

std::unique_ptr<pqxx::connection> connect(const std::string& connection) {
  std::unique_ptr<pqxx::connection> made;
  guarded([&] {
    made = std::make_unique<pqxx::connection>(with_time_limits(connection));
    pqxx::nontransaction setting(*made);
    setting.exec(
        "SET TIME ZONE 'UTC'; SET search_path = fleet; SET statement_timeout = '60s';"
        "SET client_min_messages = warning; SET extra_float_digits = 3; SET client_encoding = 'UTF8'");
  });
  return made;
}

}  // namespace cellcal::daemon::fleet
