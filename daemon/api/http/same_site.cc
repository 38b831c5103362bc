#include "daemon/api/http/same_site.h"

#include <arpa/inet.h>

#include <algorithm>
#include <string_view>

namespace cellcal::daemon {

namespace {

std::string lower(std::string text) {
  for (char& letter : text) {
    if ('A' <= letter && letter <= 'Z') letter = static_cast<char>(letter + 'a' - 'A');
  }
  return text;
}

bool is_port(std::string_view text) {
  constexpr std::size_t kDigits = 5;
  return !text.empty() && text.size() <= kDigits &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_address(int family, const std::string& text) {
  in6_addr any{};
  return ::inet_pton(family, text.c_str(), &any) == 1;
}

}  // namespace

bool host_is_ours(const Request& request, const std::vector<std::string>& names) {
  std::string host = lower(request.header("host"));
  const std::size_t colon = host.rfind(':');
  if (colon != std::string::npos && is_port(std::string_view(host).substr(colon + 1))) {
    host.resize(colon);
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    return is_address(AF_INET6, host.substr(1, host.size() - 2));
  }
  return host == "localhost" || is_address(AF_INET, host) ||
         std::find(names.begin(), names.end(), host) != names.end();
}

bool origin_is_ours(const Request& request, bool tls) {
  const std::string origin = lower(request.header("origin"));
  if (origin.empty()) return !request.headers.contains("origin");
  const std::string host = lower(request.header("host"));
  return origin == "https://" + host || (!tls && origin == "http://" + host);
}

std::string network_of(const std::string& address) {
  const std::size_t scope = std::min(address.find('%'), address.size());
  in6_addr bytes{};
  if (::inet_pton(AF_INET6, address.substr(0, scope).c_str(), &bytes) != 1) return address;
  // Otherwise all of IPv4 would count as one network.
  if (IN6_IS_ADDR_V4MAPPED(&bytes)) return address;
  constexpr std::size_t kNetworkBytes = 8;
  return std::string(reinterpret_cast<const char*>(bytes.s6_addr), kNetworkBytes) +
         address.substr(scope);
}

}  // namespace cellcal::daemon
