#include "hostile_broker.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <mutex>
#include <optional>
#include <thread>

namespace cellcal::daemon::testing {

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

constexpr int kConnect = 1, kPublish = 3, kSubscribe = 8, kPing = 12, kDisconnect = 14;

std::string length_of(std::size_t bytes) {
  std::string text;
  do {
    const auto low = static_cast<char>(bytes & 0x7fU);
    bytes >>= 7;
    text += static_cast<char>(bytes > 0 ? low | '\x80' : low);
  } while (bytes > 0);
  return text;
}

std::size_t number_at(const std::string& bytes, std::size_t at) {
  return std::size_t{static_cast<unsigned char>(bytes.at(at))} << 8 |
         static_cast<unsigned char>(bytes.at(at + 1));
}

struct Packet {
  int kind = 0, flags = 0;
  std::string body;
};

Packet read(tcp::socket& socket) {
  std::array<unsigned char, 1> byte{};
  asio::read(socket, asio::buffer(byte));
  Packet packet{byte[0] >> 4, byte[0] & 0x0f, {}};
  std::size_t length = 0, shift = 0;
  do {
    asio::read(socket, asio::buffer(byte));
    length |= std::size_t{byte[0] & 0x7fU} << shift;
    shift += 7;
  } while (byte[0] & 0x80U);
  packet.body.resize(length);
  asio::read(socket, asio::buffer(packet.body));
  return packet;
}

}  // namespace

std::vector<std::string> deadly_packets() {
  return {std::string("\x30\x06\x00\x01\x61\x02\x7f\x00", 8),
          std::string("\x40\x05\x00\x01\x00\x01\x7f", 7)};
}

std::string publish_packet(const std::string& topic, const std::string& payload) {
  const std::string body =
      std::string{static_cast<char>(topic.size() >> 8), static_cast<char>(topic.size() & 0xff)} +
      topic + '\0' + payload;
  return '\x30' + length_of(body.size()) + body;
}

struct HostileBroker::Impl {
  Impl() : acceptor(context, {asio::ip::address_v4::loopback(), 0}) {
    thread = std::thread([this] { accept(); });
  }
  ~Impl() {
    ending = true;
    boost::system::error_code ignored;
    tcp::socket knock(context);
    knock.connect(acceptor.local_endpoint(), ignored);
    thread.join();
    {
      const std::lock_guard lock(mutex);
      for (const auto& one : sockets) one->shutdown(tcp::socket::shutdown_both, ignored);
    }
    for (std::thread& one : threads) one.join();
  }
  void accept() {
    while (true) {
      auto socket = std::make_shared<tcp::socket>(context);
      boost::system::error_code code;
      acceptor.accept(*socket, code);
      if (ending || code) return;
      const std::lock_guard lock(mutex);
      sockets.push_back(socket);
      threads.emplace_back([this, socket] { serve(*socket); });
    }
  }
  void serve(tcp::socket& socket) try {
    for (;;) {
      const Packet packet = read(socket);
      const std::lock_guard lock(mutex);
      if (packet.kind == kConnect) send(socket, std::string("\x20\x03\x00\x00\x00", 5));
      if (packet.kind == kPing) send(socket, std::string("\xd0\x00", 2));
      if (packet.kind == kDisconnect) return;
      if (packet.kind == kSubscribe) {
        send(socket, "\x90\x04" + packet.body.substr(0, 2) + std::string("\x00\x01", 2));
        if (std::find(subscribed.begin(), subscribed.end(), &socket) == subscribed.end())
          subscribed.push_back(&socket), ++count;
        if (greeting) send(socket, greeting());
      }
      if (packet.kind == kPublish) take(socket, packet);
    }
  } catch (const boost::system::system_error&) {  // disconnected
    const std::lock_guard lock(mutex);
    std::erase(subscribed, &socket);
  }
  /// For properties with a length of one byte.
  void take(tcp::socket& socket, const Packet& packet) {
    const bool acknowledged = (packet.flags & 0x06) != 0;
    const std::size_t topic = number_at(packet.body, 0), id = 2 + topic;
    const std::size_t properties = id + (acknowledged ? 2 : 0);
    const std::size_t payload =
        properties + 1 + static_cast<unsigned char>(packet.body.at(properties));
    published.push_back({packet.body.substr(2, topic), packet.body.substr(payload)});
    if (acknowledged) send(socket, "\x40\x02" + packet.body.substr(id, 2));
  }
  static void send(tcp::socket& socket, const std::string& bytes) {
    boost::system::error_code ignored;  // reading reports the disconnection
    asio::write(socket, asio::buffer(bytes), ignored);
  }

  asio::io_context context;
  tcp::acceptor acceptor;
  std::atomic<bool> ending{false};
  mutable std::mutex mutex;
  std::vector<std::shared_ptr<tcp::socket>> sockets;
  std::vector<tcp::socket*> subscribed;
  int count = 0;
  std::function<std::string()> greeting;
  std::vector<Published> published;
  std::vector<std::thread> threads;
  std::thread thread;
};

HostileBroker::HostileBroker() : impl_(std::make_unique<Impl>()) {}
HostileBroker::~HostileBroker() = default;

std::uint16_t HostileBroker::port() const { return impl_->acceptor.local_endpoint().port(); }

int HostileBroker::say(const std::string& bytes) {
  const std::lock_guard lock(impl_->mutex);
  for (tcp::socket* one : impl_->subscribed) Impl::send(*one, bytes);
  return static_cast<int>(impl_->subscribed.size());
}

void HostileBroker::greet_with(std::function<std::string()> bytes) {
  const std::lock_guard lock(impl_->mutex);
  impl_->greeting = std::move(bytes);
}

int HostileBroker::lines() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->count;
}

std::vector<HostileBroker::Published> HostileBroker::published() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->published;
}

}  // namespace cellcal::daemon::testing
