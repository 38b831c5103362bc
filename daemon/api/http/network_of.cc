#include "daemon/api/http/network_of.h"

#include <arpa/inet.h>

#include <algorithm>

namespace cellcal::daemon {

std::string network_of(const std::string& address) {
  const std::size_t scope = std::min(address.find('%'), address.size());
  in6_addr bytes{};
  if (::inet_pton(AF_INET6, address.substr(0, scope).c_str(), &bytes) != 1) return address;
  if (IN6_IS_ADDR_V4MAPPED(&bytes)) return address;  // or all of IPv4 would be one network
  constexpr std::size_t kNetworkBytes = 8;
  return std::string(reinterpret_cast<const char*>(bytes.s6_addr), kNetworkBytes) +
         address.substr(scope);
}

}  // namespace cellcal::daemon
