#include "daemon/api/tokens.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/input_file.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr const char* kFormat = "cellcal.tokens/1";
constexpr std::size_t kMostTokens = 1000, kMostBytes = 1u << 20;
constexpr std::size_t kLongestTokenName = 64;
constexpr const char* kHex = "0123456789abcdef";

/// Text of the key; throws where it is missing or not a string.
std::string token_field(const json& object, const char* key) {
  return object.at(key).get<std::string>();
}

Token token_of(const json& value) {
  Token token{token_field(value, "name"), Role::kNobody, token_field(value, "sha256"),
              token_field(value, "created")};
  const auto role = parse_role(token_field(value, "role"));
  const bool sound = role && is_token_name(token.name) && calib::is_sha256(token.sha256);
  constexpr std::size_t kKeys = 4;
  if (!sound || value.size() != kKeys) throw std::runtime_error("a token is malformed");
  token.role = *role;
  return token;
}

/// Throws on any malformed content.
std::vector<Token> parse(const std::string& text) {
  const json document = json::parse(text);
  if (document.size() != 2 || token_field(document, "format") != kFormat) {
    throw std::runtime_error(std::string("format must be \"") + kFormat + "\"");
  }
  const json& list = document.at("tokens");
  if (!list.is_array() || list.size() > kMostTokens) throw std::runtime_error("no list of tokens");
  std::vector<Token> tokens;
  std::set<std::string> names;
  for (const json& value : list) {
    tokens.push_back(token_of(value));
    if (!names.insert(tokens.back().name).second) throw std::runtime_error("a name is given twice");
  }
  return tokens;
}

std::string token_field(const std::vector<Token>& tokens) {
  json list = json::array();
  for (const Token& token : tokens) {
    list.push_back({{"name", token.name},
                    {"role", to_string(token.role)},
                    {"sha256", token.sha256},
                    {"created", token.created}});
  }
  return json{{"format", kFormat}, {"tokens", list}}.dump(1) + "\n";
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (file.bad() || text.size() > kMostBytes) throw std::runtime_error("cannot be read");
  return text;
}

bool is_open_to_others(const std::filesystem::path& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 && (info.st_mode & (S_IRWXG | S_IRWXO)) != 0;
}

/// Compares with all tokens, so that the duration reveals nothing.
std::optional<Token> match(const std::vector<Token>& tokens, std::string_view sha256) {
  std::optional<Token> found;
  for (const Token& token : tokens) {
    if (token.sha256.size() == sha256.size() &&
        ::CRYPTO_memcmp(token.sha256.data(), sha256.data(), sha256.size()) == 0) {
      found = token;
    }
  }
  return found;
}

}  // namespace

std::string random_secret() {
  std::array<unsigned char, 32> bytes{};
  if (::RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("the system has no random numbers");
  }
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kHex[byte >> 4];
    text += kHex[byte & 0xF];
  }
  return text;
}

bool is_token_name(std::string_view name) {
  constexpr const char* kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  return !name.empty() && name.size() <= kLongestTokenName &&
         name.find_first_not_of(kLetters) == std::string_view::npos;
}

TokenStore::TokenStore(std::filesystem::path file)
    : file_(std::move(file)), tokens_(std::make_shared<const Tokens>()) {
  if (!std::filesystem::exists(file_)) return;
  if (is_open_to_others(file_)) {
    problem_ = file_.string() +
               ": accessible to other users. No token is accepted. Check who changed it, then "
               "'chmod 600' it and restart cellcald";
    return;
  }
  try {
    tokens_ = std::make_shared<const Tokens>(parse(read(file_)));
  } catch (const std::exception& error) {
    problem_ = file_.string() + ": " + system_words(error) +
               ". No token is accepted. Remove the file, restart cellcald and add the tokens again";
  }
}

std::string TokenStore::add(const std::string& name, Role role, const std::string& utc) {
  if (!is_token_name(name)) {
    throw TokenError("the name must have 1 to 64 letters, digits, '.', '_' or '-'");
  }
  if (name == kLocalName)
    throw TokenError("the name \"local\" is reserved for the Unix socket. Choose another");
  const std::lock_guard lock(writing_);
  if (!problem_.empty()) throw TokenError(problem_);
  Tokens next = *tokens();
  if (std::any_of(next.begin(), next.end(), [&](const Token& one) { return one.name == name; })) {
    throw TokenError("a token \"" + name + "\" exists. Choose another name, or 'cellcal " +
                     "token remove " + name + "' first");
  }
  if (next.size() >= kMostTokens) throw TokenError("1000 tokens exist. Remove some first");
  const std::string secret = random_secret();
  next.push_back({name, role, calib::sha256(secret), utc});
  store(std::move(next));
  return secret;
}

bool TokenStore::remove(const std::string& name) {
  const std::lock_guard lock(writing_);
  if (!problem_.empty()) throw TokenError(problem_);
  Tokens next = *tokens();
  if (std::erase_if(next, [&](const Token& one) { return one.name == name; }) == 0) return false;
  store(std::move(next));
  return true;
}

/// Written to disk first, so that a change is still effective after a restart.
void TokenStore::store(Tokens next) {
  write_atomically(file_, token_field(next), Readers::kOwner);
  auto kept = std::make_shared<const Tokens>(std::move(next));
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(kept);
}

std::shared_ptr<const TokenStore::Tokens> TokenStore::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

std::vector<Token> TokenStore::list() const { return *tokens(); }

std::optional<Token> TokenStore::find(std::string_view token) const {
  return match(*tokens(), calib::sha256(token));
}

std::optional<Token> TokenStore::find_by_sha256(std::string_view sha256) const {
  return match(*tokens(), sha256);
}

}  // namespace cellcal::daemon
