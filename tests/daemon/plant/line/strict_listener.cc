#include "strict_listener.h"

#include <array>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cellcal::daemon::testing {

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

/// Size of the first packet with its header, once known.
std::optional<std::size_t> packet_bytes(const std::string& stream) {
  std::size_t length = 0, shift = 0;
  for (std::size_t i = 1; i < stream.size() && i <= 4; ++i) {
    const auto byte = static_cast<unsigned char>(stream[i]);
    length |= std::size_t{byte & 0x7fU} << shift;
    shift += 7;
    if ((byte & 0x80U) == 0) return 1 + i + length;
  }
  return std::nullopt;
}

constexpr std::array<unsigned char, 4> kTooLarge{0xE0, 0x02, 0x95, 0x00};  // DISCONNECT

}  // namespace

struct StrictListener::Impl {
  Impl(std::uint16_t to, std::size_t bytes)
      : broker(to), most(bytes), acceptor(context, {asio::ip::address_v4::loopback(), 0}) {
    thread = std::thread([this] { accept(); });
  }
  ~Impl() {
    ending = true;
    boost::system::error_code ignored;
    tcp::socket knock(context);
    knock.connect(acceptor.local_endpoint(), ignored);
    thread.join();
    end_all();
    for (std::thread& one : lines) one.join();
  }
  void end_all() {
    const std::lock_guard lock(mutex);
    boost::system::error_code ignored;
    for (const auto& socket : sockets) socket->shutdown(tcp::socket::shutdown_both, ignored);
  }
  void accept() {
    while (true) {
      auto client = std::make_shared<tcp::socket>(context),
           server = std::make_shared<tcp::socket>(context);
      boost::system::error_code code;
      acceptor.accept(*client, code);
      if (ending || code) return;
      server->connect({asio::ip::address_v4::loopback(), broker}, code);
      if (code) continue;
      {
        const std::lock_guard lock(mutex);
        sockets.push_back(client);
        sockets.push_back(server);
      }
      lines.emplace_back([this, client, server] { pass(*client, *server, true); });
      lines.emplace_back([this, client, server] { pass(*server, *client, false); });
    }
  }
  void pass(tcp::socket& from, tcp::socket& to, bool strict) {
    std::array<char, 65536> part{};
    std::string packet;
    boost::system::error_code code;
    while (true) {
      const std::size_t read = from.read_some(asio::buffer(part), code);
      if (code) break;
      if (!strict) {
        asio::write(to, asio::buffer(part, read), code);
        continue;
      }
      packet.append(part.data(), read);
      while (const auto bytes = packet_bytes(packet)) {
        if (*bytes > most) {
          ++refused;
          asio::write(from, asio::buffer(kTooLarge), code);
          shut(from, to);
          return;
        }
        if (packet.size() < *bytes) break;
        asio::write(to, asio::buffer(packet.data(), *bytes), code);
        packet.erase(0, *bytes);
      }
    }
    shut(from, to);
  }
  static void shut(tcp::socket& a, tcp::socket& b) {
    boost::system::error_code ignored;
    a.shutdown(tcp::socket::shutdown_both, ignored);
    b.shutdown(tcp::socket::shutdown_both, ignored);
  }

  asio::io_context context;
  std::uint16_t broker;
  std::atomic<std::size_t> most;
  std::atomic<int> refused{0};
  std::atomic<bool> ending{false};
  tcp::acceptor acceptor;
  std::mutex mutex;
  std::vector<std::shared_ptr<tcp::socket>> sockets;
  std::vector<std::thread> lines;  ///< used by the acceptor's thread only, until it has ended
  std::thread thread;
};

StrictListener::StrictListener(std::uint16_t broker, std::size_t most_bytes)
    : impl_(std::make_unique<Impl>(broker, most_bytes)) {}
StrictListener::~StrictListener() = default;
std::uint16_t StrictListener::port() const { return impl_->acceptor.local_endpoint().port(); }
void StrictListener::accept_all() {
  impl_->most = std::size_t{1} << 30;
  impl_->end_all();
}
void StrictListener::say(const std::string& bytes) {
  const std::lock_guard lock(impl_->mutex);
  boost::system::error_code gone;
  for (std::size_t i = 0; i < impl_->sockets.size(); i += 2)
    asio::write(*impl_->sockets[i], asio::buffer(bytes), gone);
}
int StrictListener::ended() const { return impl_->refused; }

}  // namespace cellcal::daemon::testing
