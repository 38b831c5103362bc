// Choice of the connection to close when there are too many.

#include <gtest/gtest.h>

#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/api/http/server_impl.h"

namespace cellcal::daemon {
namespace {

class Client final : public Connection {
 public:
  explicit Client(const std::string& peer, std::weak_ptr<HttpServer::Impl> server)
      : Connection(peer), server_(std::move(server)) {}
  void start() override {}
  void ask(bool) override {}
  void close() override {
    gone = true;
    // By its address, since the list may hold the last reference.
    const auto server = server_.lock();
    for (const auto& one : std::list(server->connections))
      if (one.get() == this) server->remove(one);
  }
  bool gone = false;

 private:
  std::weak_ptr<HttpServer::Impl> server_;
};

class Nowhere final : public HttpServer::Impl {
 public:
  using Impl::Impl;
  void accept() override {}
  void stop_listening() override {}
};

struct Connections : ::testing::Test {
  std::shared_ptr<Client> connect(const std::string& peer) {
    auto client = std::make_shared<Client>(peer, server);
    server->add(client);
    all.push_back(client);
    return client;
  }
  boost::asio::io_context context;
  std::shared_ptr<Nowhere> server = std::make_shared<Nowhere>(context, ServerParts{});
  std::vector<std::shared_ptr<Client>> all;
};

TEST_F(Connections, OfOneIpv6NetworkCountAsOneHosts) {
  for (int i = 0; i < 31; ++i) connect("10.0.0." + std::to_string(i + 1));
  for (int i = 0; i < 400; ++i) connect("2001:db8::" + std::to_string(i + 1));
  for (int i = 0; i < 31; ++i) EXPECT_FALSE(all[i]->gone) << i;
  EXPECT_TRUE(all[31]->gone) << "its oldest goes first";
  EXPECT_FALSE(all.back()->gone);
}

TEST(ANetwork, IsOfIpv6WhatAHostHasAllOf) {
  EXPECT_EQ(network_of("2001:db8::1"), network_of("2001:db8::ffff:2"));
  EXPECT_NE(network_of("2001:db8::1"), network_of("2001:db8:0:1::1"));
  EXPECT_EQ(network_of("fe80::1%eth0"), network_of("fe80::2%eth0"));
  EXPECT_NE(network_of("fe80::1%eth0"), network_of("fe80::1%eth1"));
  EXPECT_NE(network_of("10.0.0.1"), network_of("10.0.0.2"));
  EXPECT_NE(network_of("::ffff:10.0.0.1"), network_of("::ffff:10.0.0.2"));
}

}  // namespace
}  // namespace cellcal::daemon
