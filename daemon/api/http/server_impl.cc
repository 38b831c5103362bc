// Listener on a TCP address.

#include "daemon/api/http/server_impl.h"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <openssl/x509.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>

#include "daemon/api/http/connection_on.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

/// A silently lost peer ends its connection after this time without an acknowledgement.
constexpr int kLongestUnheardMs = 15'000;

/// OpenSSL names no reason of a file that cannot be opened.
void require_readable(const char* key, const std::filesystem::path& file) {
  if (::access(file.c_str(), R_OK) == 0) return;
  throw SocketError(fmt::format(
      "{} {}: {}. Give a file in PEM that the service's user may read (chgrp cellcal, chmod 640)",
      key, file.string(), std::strerror(errno)));
}

asio::ssl::context tls_context(const NetworkAddress& address) {
  require_readable("tls_certificate", address.tls_certificate);
  require_readable("tls_key", address.tls_key);
  using Tls = asio::ssl::context;
  Tls tls(Tls::tls_server);
  tls.set_options(Tls::default_workarounds | Tls::no_sslv2 | Tls::no_sslv3 | Tls::no_tlsv1 |
                  Tls::no_tlsv1_1 | Tls::no_compression);
  ::SSL_CTX_set_options(tls.native_handle(), SSL_OP_NO_RENEGOTIATION);
  // TLS 1.2 is limited to cipher suites with forward secrecy; TLS 1.3 has no others.
  ::SSL_CTX_set_cipher_list(tls.native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20");
  error_code code;
  tls.use_certificate_chain_file(address.tls_certificate.string(), code);
  if (code) {
    throw SocketError("tls_certificate " + address.tls_certificate.string() + ": " +
                      code.message() + ". Give a file in PEM that cellcald may read");
  }
  tls.use_private_key_file(address.tls_key.string(), Tls::pem, code);
  if (!code && ::SSL_CTX_check_private_key(tls.native_handle()) == 1) return tls;
  throw SocketError("tls_key " + address.tls_key.string() + ": " +
                    (code ? code.message() : "not the certificate's") +
                    ". Give the certificate's key in PEM, without a password, that cellcald may "
                    "read");
}

using Written = std::array<std::filesystem::file_time_type, 2>;

/// Times of certificate and key.
Written written_at(const NetworkAddress& address) {
  std::error_code missing;
  return {std::filesystem::last_write_time(address.tls_certificate, missing),
          std::filesystem::last_write_time(address.tls_key, missing)};
}

class NetworkListener final : public HttpServer::Impl {
 public:
  NetworkListener(asio::io_context& io, const NetworkAddress& address, ServerParts given)
      : Impl(io, std::move(given)), address_(address), acceptor_(io) {
    if (!address.tls_certificate.empty()) {
      tls_written_ = written_at(address);
      tls_.emplace(tls_context(address));
    }
    error_code code;
    const tcp::endpoint at(asio::ip::make_address(address.address, code), address.port);
    if (!code) acceptor_.open(at.protocol(), code);
    if (!code) acceptor_.set_option(tcp::acceptor::reuse_address(true), code);
    if (!code) acceptor_.bind(at, code);
    if (!code) acceptor_.listen(asio::socket_base::max_listen_connections, code);
    if (code) {
      throw SocketError("cannot listen on " + address.address + " port " +
                        std::to_string(address.port) + ": " + code.message() +
                        ". Set a free port and an address of this computer ('ip address' lists "
                        "them): listen of [http]");
    }
  }

  void accept() override {
    acceptor_.async_accept([self = shared_from_this(), this](error_code code, tcp::socket peer) {
      if (stopped || code == asio::error::operation_aborted) return;
      if (code) return accept_later();
      take(std::move(peer));
      accept();
    });
  }
  void stop_listening() override {
    error_code ignored;  // the connection is closed in any case
    acceptor_.close(ignored);
  }
  std::uint16_t port() const override {
    error_code ignored;  // closed: no port
    return acceptor_.local_endpoint(ignored).port();
  }

 private:
  void take(tcp::socket peer) {
    error_code gone;
    const tcp::endpoint from = peer.remote_endpoint(gone);
    if (gone) return;
    peer.set_option(tcp::no_delay(true), gone);
    ::setsockopt(peer.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kLongestUnheardMs,
                 sizeof kLongestUnheardMs);
    const std::string address = from.address().to_string();
    beast::tcp_stream stream(std::move(peer));
    if (!tls_)
      return add(std::make_shared<ConnectionOn<beast::tcp_stream>>(std::move(stream), address,
                                                                   weak_from_this()));
    renew_tls();
    using TlsStream = beast::ssl_stream<beast::tcp_stream>;
    add(std::make_shared<ConnectionOn<TlsStream>>(TlsStream(std::move(stream), *tls_), address,
                                                  weak_from_this()));
  }

  /// A renewed certificate counts from the next connection on. Files that do not fit together, as while they are
  /// replaced, leave the former one.
  void renew_tls() {
    const Written now = written_at(address_);
    if (now == tls_written_) return;
    tls_written_ = now;
    try {
      tls_.emplace(tls_context(address_));
      spdlog::info("[http]: certificate read again, {}", address_.tls_certificate.string());
    } catch (const SocketError& error) {
      spdlog::warn("[http]: the former certificate stays in use: {}", error.what());
    }
  }

  NetworkAddress address_;
  tcp::acceptor acceptor_;
  std::optional<asio::ssl::context> tls_;
  Written tls_written_{};
};

}  // namespace

void check_tls(const NetworkAddress& address) {
  if (address.tls_certificate.empty()) return;
  asio::ssl::context tls = tls_context(address);
  const X509* own = ::SSL_CTX_get0_certificate(tls.native_handle());
  if (::X509_cmp_current_time(::X509_get0_notAfter(own)) < 0)
    throw SocketError("tls_certificate " + address.tls_certificate.string() +
                      ": expired. Renew it; browsers refuse the page until then");
}

std::shared_ptr<HttpServer::Impl> listen_on(asio::io_context& context,
                                            const NetworkAddress& address, ServerParts parts) {
  return std::make_shared<NetworkListener>(context, address, std::move(parts));
}

}  // namespace cellcal::daemon
