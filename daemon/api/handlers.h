#pragma once
// From a request to its answer.

#include <optional>
#include <string>

#include "daemon/api/message.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

class Api {
 public:
  Api(SessionService& service, Journal& journal) : service_(service), journal_(journal) {}

  /// Nothing: there is no answer yet; ask again when the service has changed, or say give_up.
  std::optional<Response> answer(const Request& request, bool give_up = true);

  /// It may wait for the disk or for long work. Those that are not wait for nothing: status, watch
  /// and abort are answered whatever the others do.
  static bool is_slow(const Request& request);

 private:
  Response run(const Request& request);
  Response abort();
  Response sessions();
  Response session(const std::string& rest);
  Response result(std::int64_t session, const std::string& file);

  SessionService& service_;
  Journal& journal_;
};

/// One JSON object without line breaks.
std::string status_to_json(const Status& status);

}  // namespace cellcal::daemon
