#include "daemon/certificate/ed25519.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "calib/files/input_file.h"

namespace cellcal::daemon::signing {

namespace {

namespace fs = std::filesystem;

/// Well above the size of any PEM key.
constexpr std::size_t kMostKeyBytes = 16384;

struct Free {
  void operator()(BIO* bio) const { BIO_free_all(bio); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};
using Bio = std::unique_ptr<BIO, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;
using Context = std::unique_ptr<EVP_MD_CTX, Free>;

/// Never prompts for a passphrase.
int no_passphrase(char*, int, int, void*) { return 0; }

Bio bio_of(const std::string& pem) {
  return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
}

Key private_of(const std::string& pem) {
  return Key(PEM_read_bio_PrivateKey(bio_of(pem).get(), nullptr, no_passphrase, nullptr));
}
Key public_of(const std::string& pem) {
  return Key(PEM_read_bio_PUBKEY(bio_of(pem).get(), nullptr, no_passphrase, nullptr));
}

bool is_ed25519(const Key& key) { return key && EVP_PKEY_id(key.get()) == EVP_PKEY_ED25519; }

std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

std::string fingerprint_of(const Key& key) {
  const Bio der(BIO_new(BIO_s_mem()));
  i2d_PUBKEY_bio(der.get(), key.get());
  return calib::sha256(text_of(der.get()));
}

class File {
 public:
  File(const fs::path& path, int flags, mode_t mode = 0)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {
    if (fd_ < 0) throw KeyError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  ~File() { ::close(fd_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

void write_new(const fs::path& path, const std::string& text, mode_t mode) {
  const File file(path, O_WRONLY | O_CREAT | O_EXCL, mode);
  const bool whole =
      ::fchmod(file.get(), mode) == 0 &&
      ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      ::fsync(file.get()) == 0;
  if (whole) return;
  const std::string why = std::strerror(errno);
  ::unlink(path.c_str());
  throw KeyError(fmt::format("{}: not written: {}", path.string(), why));
}

std::string read_some(const fs::path& path, const File& file) {
  std::string text(kMostKeyBytes + 1, '\0');
  const ssize_t size = ::read(file.get(), text.data(), text.size());
  if (size < 0) throw KeyError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  if (static_cast<std::size_t>(size) > kMostKeyBytes)
    throw KeyError(fmt::format("{}: too large for a key", path.string()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

[[noreturn]] void refuse_kind(const fs::path& path, const char* part) {
  throw KeyError(fmt::format(
      "{}: no {} Ed25519 key in PEM without a passphrase. Make one: 'cellcal certificate "
      "--make-key --key FILE'",
      path.string(), part));
}

std::string private_pem(const Key& key) {
  const Bio out(BIO_new(BIO_s_mem()));
  PEM_write_bio_PKCS8PrivateKey(out.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  return text_of(out.get());
}

std::string public_pem(const Key& key) {
  const Bio out(BIO_new(BIO_s_mem()));
  PEM_write_bio_PUBKEY(out.get(), key.get());
  return text_of(out.get());
}

const unsigned char* bytes(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

fs::path public_part(const fs::path& key) { return fs::path(key) += ".pub"; }

void make_key(const fs::path& key) {
  std::error_code code;
  for (const fs::path& one : {key, public_part(key)})
    if (fs::exists(fs::symlink_status(one, code)))
      throw KeyError(one.string() +
                     ": exists. Keys are never overwritten: choose another file with --key FILE");
  const Key made(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  if (!made) throw KeyError(key.string() + ": OpenSSL made no key");
  write_new(key, private_pem(made), S_IRUSR | S_IWUSR);
  write_new(public_part(key), public_pem(made), S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH);
}

PrivateKey::PrivateKey(const fs::path& path) {
  const File file(path, O_RDONLY | O_NONBLOCK);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode))
    throw KeyError(path.string() + ": not a regular file");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw KeyError(fmt::format(
        "{}: mode {:04o}, accessible to others than its owner. Set 0600, or make a new key if it may "
        "have been read",
        path.string(), status.st_mode & 07777U));
  pem_ = read_some(path, file);
  if (!is_ed25519(private_of(pem_))) refuse_kind(path, "private");
}

std::string PrivateKey::sign(std::string_view text) const {
  const Key key = private_of(pem_);
  const Context context(EVP_MD_CTX_new());
  std::string signature(kSignatureBytes, '\0');
  std::size_t size = signature.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()) != 1 ||
      EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size,
                     bytes(text), text.size()) != 1 ||
      size != kSignatureBytes)
    throw KeyError("OpenSSL did not sign");
  return signature;
}

std::string PrivateKey::fingerprint() const { return fingerprint_of(private_of(pem_)); }

std::optional<PrivateKey> key_if_there(const fs::path& file) {
  std::error_code code;
  // Status of the link itself: a dangling link is an unreadable key.
  const fs::file_status status = fs::symlink_status(file, code);
  if (status.type() == fs::file_type::not_found) return std::nullopt;
  if (!fs::status_known(status))
    throw KeyError(fmt::format(
        "{}: cannot be accessed: {}. Choose another key with --key FILE, or give --no-sign",
        file.string(), code.message()));
  return PrivateKey(file);
}

PublicKey::PublicKey(const fs::path& path) {
  const File file(path, O_RDONLY | O_NONBLOCK);
  pem_ = read_some(path, file);
  if (!is_ed25519(public_of(pem_))) refuse_kind(path, "public");
}

bool PublicKey::verifies(std::string_view text, std::string_view signature) const {
  if (signature.size() != kSignatureBytes) return false;
  const Key key = public_of(pem_);
  const Context context(EVP_MD_CTX_new());
  return EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
         EVP_DigestVerify(context.get(), bytes(signature), signature.size(), bytes(text),
                          text.size()) == 1;
}

std::string PublicKey::fingerprint() const { return fingerprint_of(public_of(pem_)); }

}  // namespace cellcal::daemon::signing
