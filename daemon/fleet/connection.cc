#include "daemon/fleet/connection.h"

#include <libpq-fe.h>

#include <algorithm>
#include <array>

namespace cellcal::daemon::fleet {

namespace {

/// check_violation: no partition for a row; no other check of the tables can fail for a message.
constexpr const char* kNoMonth = "23514";
/// lock_not_available: lock_timeout has passed.
constexpr const char* kLocked = "55P03";

/// SQLSTATE classes of errors due to the values: data exception, integrity constraint, program
/// limit.
bool is_data(const std::string& state) {
  return state.starts_with("22") || state.starts_with("23") || state.starts_with("54");
}

struct Limit {
  std::string_view key;
  const char* value;
};
constexpr std::array kLimits{Limit{"connect_timeout", "10"}, Limit{"keepalives_idle", "10"},
                             Limit{"keepalives_interval", "5"}, Limit{"keepalives_count", "3"},
                             Limit{"tcp_user_timeout", "30000"}};

/// Time limit of an option; null for options without one.
const char* limit_of(std::string_view key) {
  const auto* const found = std::find_if(kLimits.begin(), kLimits.end(),
                                         [&](const Limit& one) { return one.key == key; });
  return found == kLimits.end() ? nullptr : found->value;
}

std::string quoted(const char* value) {
  std::string text = "'";
  for (; *value != '\0'; ++value) {
    if (*value == '\'' || *value == '\\') text += '\\';
    text += *value;
  }
  return text + '\'';
}

std::string first_line(const std::string& words) { return words.substr(0, words.find('\n')); }

}  // namespace

std::string with_time_limits(const std::string& connection) {
  struct Free {
    void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
  };
  const std::unique_ptr<PQconninfoOption, Free> options(
      PQconninfoParse(connection.c_str(), nullptr));
  if (!options) return connection;  // connecting reports the error
  std::string all;
  for (const PQconninfoOption* one = options.get(); one->keyword != nullptr; ++one) {
    const char* value = one->val != nullptr ? one->val : limit_of(one->keyword);
    if (value != nullptr) all += std::string(one->keyword) + '=' + quoted(value) + ' ';
  }
  return all;
}

void guarded(const std::function<void()>& work) {
  try {
    work();
  } catch (const pqxx::sql_error& error) {
    if (error.sqlstate() == kNoMonth) throw NoMonth(first_line(error.what()));
    if (error.sqlstate() == kLocked) throw Locked(first_line(error.what()));
    if (is_data(error.sqlstate())) throw BadData(first_line(error.what()));
    throw StoreUnavailable(first_line(error.what()));
  } catch (
      const pqxx::failure& error) {  // also in_doubt_error: it is unknown whether it was committed
    throw StoreUnavailable(first_line(error.what()));
  }
}

std::unique_ptr<pqxx::connection> connect(const std::string& connection) {
  std::unique_ptr<pqxx::connection> made;
  guarded([&] {
    made = std::make_unique<pqxx::connection>(with_time_limits(connection));
    pqxx::nontransaction setting(*made);
    // Compiling the views' plans takes half a second, running them a few milliseconds.
    setting.exec(
        "SET jit = off;"
        "SET TIME ZONE 'UTC'; SET search_path = fleet; SET statement_timeout = '60s';"
        "SET client_min_messages = warning; SET extra_float_digits = 3; SET client_encoding = 'UTF8'");
  });
  return made;
}

}  // namespace cellcal::daemon::fleet
