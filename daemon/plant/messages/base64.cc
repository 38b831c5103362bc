#include "daemon/plant/messages/base64.h"

#include <openssl/evp.h>

#include <limits>

namespace cellcal::daemon::plant {

namespace {

constexpr std::size_t kMost = std::size_t{1} << 28;  // OpenSSL counts in int
static_assert(kMost < std::numeric_limits<int>::max() / 2);

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

std::string to_base64(std::string_view bytes) {
  if (bytes.size() > kMost) bytes = bytes.substr(0, kMost);
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes_of(bytes),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  if (text.empty()) return std::string();
  // EVP_DecodeBlock forgives blanks around it and padding in the middle.
  const std::size_t end = text.find_last_not_of('=');
  const std::size_t padding = end == std::string_view::npos ? text.size() : text.size() - end - 1;
  if (text.size() % 4 != 0 || text.size() > kMost || padding > 2 ||
      text.substr(0, text.size() - padding)
              .find_first_not_of(
                  "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/") !=
          std::string_view::npos)
    return std::nullopt;
  std::string bytes(text.size() / 4 * 3, '\0');
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()), bytes_of(text),
                                   static_cast<int>(text.size()));
  if (size < 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(size) - padding);
  if (to_base64(bytes) != text) return std::nullopt;  // bits behind the last byte
  return bytes;
}

}  // namespace cellcal::daemon::plant
