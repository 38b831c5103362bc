#include "daemon/fleet/api/fleet_server.h"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <mutex>
#include <thread>

#include "daemon/api/http/same_site.h"
#include "daemon/api/http/server.h"
#include "daemon/api/page/page.h"
#include "daemon/fleet/api/answers.h"

namespace cellcal::daemon::fleet {

namespace asio = boost::asio;

struct FleetServer::Impl {
  Impl(const Listen& listen, std::string database, const Counters& given)
      : reading(std::move(database)), counters(given), local(context, listen.socket, parts()) {
    if (!listen.address.empty())
      network.emplace(context, NetworkAddress{listen.address, listen.port},
                      parts(listen.host_names));
    thread = std::thread([this] { context.run(); });
  }

  /// `names`: of this computer, beside its addresses.
  ServerParts parts(std::vector<std::string> names = {}) {
    ServerParts made;
    made.admit = [names = std::move(names)](Request& request) -> std::optional<Response> {
      if (!request.is_from_network() || host_is_ours(request, names)) return std::nullopt;
      return error(
          403,
          "this Host is not known as this computer's. Ask by its address, or add the name to "
          "host_names of [http]");
    };
    made.handler = [this](const Request& request, bool) -> std::optional<Response> {
      if (std::optional<Response> page = page_answer_at(request, kFleetPage)) return page;
      const std::lock_guard lock(mutex);  // each server has a thread for slow requests
      return answer(request, reading, counters);
    };
    made.slow = [](const Request&) { return true; };  // the database may take its time
    return made;
  }

  std::mutex mutex;
  Reading reading;
  const Counters& counters;
  asio::io_context context;
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  HttpServer local;
  std::optional<HttpServer> network;
  std::thread thread;
};

FleetServer::FleetServer(const Listen& listen, std::string database, const Counters& counters)
    : impl_(std::make_unique<Impl>(listen, std::move(database), counters)) {}

FleetServer::~FleetServer() {
  asio::post(impl_->context, [this] {
    impl_->local.stop();
    if (impl_->network) impl_->network->stop();
    impl_->work.reset();
    impl_->context.stop();
  });
  impl_->thread.join();
}

std::uint16_t FleetServer::port() const { return impl_->network ? impl_->network->port() : 0; }

}  // namespace cellcal::daemon::fleet
