#include "daemon/certificate/signed_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <sstream>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon::signing {

namespace {

namespace fs = std::filesystem;
using Why = NotVerified::Why;

constexpr const char* kFormat = "# cellcal.signature/1";
constexpr std::size_t kMostLines = 100;

struct Names {
  const char *sums, *signature;
};
Names names_of(Kind kind) {
  return kind == Kind::kExport ? Names{kExportSums, kExportSignature} : Names{kSums, kSignature};
}
/// Names of the signature files, which are not signed themselves.
bool is_reserved(const std::string& name) {
  return name == kSums || name == kSignature || name == kExportSums || name == kExportSignature;
}

struct Sums {
  Statement statement;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, SHA-256
};

std::string text_of(const Sums& sums) {
  std::string text =
      fmt::format("{}\n# certificate: {}\n# signed at: {}\n# signed by: {}\n# key: {}\n", kFormat,
                  printable(sums.statement.certificate), printable(sums.statement.utc),
                  printable(sums.statement.by), sums.statement.key);
  for (const auto& [name, sum] : sums.files) text += fmt::format("{}  {}\n", sum, name);
  return text;
}

std::optional<std::string> behind(const std::string& line, const std::string& mark) {
  if (!line.starts_with(mark)) return std::nullopt;
  return line.substr(mark.size());
}

/// A file name within the directory of the sums, printable on a terminal.
bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && !is_reserved(name) &&
         name.find_first_of("/\\") == std::string::npos && printable(name) == name;
}

const std::string* sum_of(const Sums& sums, const std::string& name) {
  const auto found =
      std::ranges::find(sums.files, name, &std::pair<std::string, std::string>::first);
  return found == sums.files.end() ? nullptr : &found->second;
}

/// None for any other format.
std::optional<Sums> sums_of(const std::string& text) {
  Sums sums;
  std::istringstream lines(text);
  std::string line;
  if (!std::getline(lines, line) || line != kFormat) return std::nullopt;
  for (std::size_t i = 0; i < kMostLines && std::getline(lines, line); ++i) {
    if (const auto value = behind(line, "# certificate: "))
      sums.statement.certificate = *value;
    else if (const auto at = behind(line, "# signed at: "))
      sums.statement.utc = *at;
    else if (const auto by = behind(line, "# signed by: "))
      sums.statement.by = *by;
    else if (const auto key = behind(line, "# key: "))
      sums.statement.key = *key;
    else if (line.size() > calib::kSha256Digits + 2 &&
             calib::is_sha256(line.substr(0, calib::kSha256Digits)) &&
             line.substr(calib::kSha256Digits, 2) == "  ") {
      const std::string name = line.substr(calib::kSha256Digits + 2);
      if (!is_plain_name(name) || sum_of(sums, name) != nullptr) return std::nullopt;
      sums.files.emplace_back(name, line.substr(0, calib::kSha256Digits));
    } else
      return std::nullopt;
  }
  if (sums.files.empty() || !calib::is_sha256(sums.statement.key)) return std::nullopt;
  return sums;
}

std::string read_or_refuse(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code))
    throw NotVerified(
        Why::kNoSignature,
        path.string() +
            ": is missing: not signed. Ask the issuer for all files of the certificate");
  return calib::read_file(path);
}

Sums signed_sums(const fs::path& directory, Kind kind, const PublicKey& key) {
  const Names names = names_of(kind);
  const std::string text = read_or_refuse(directory / names.sums),
                    signature = read_or_refuse(directory / names.signature);
  const auto sums = sums_of(text);
  if (!sums)
    throw NotVerified(Why::kDamagedSignature,
                      (directory / names.sums).string() +
                          ": damaged. Ask the issuer for all files of the certificate");
  if (sums->statement.key != key.fingerprint())
    throw NotVerified(
        Why::kOtherKey,
        fmt::format("{}: signed by another key, {}; expected {}. Give the issuer's key: --key FILE",
                    (directory / names.sums).string(), sums->statement.key, key.fingerprint()));
  if (!key.verifies(text, signature))
    throw NotVerified(
        Why::kDamagedSignature,
        fmt::format("{}: the signature is not of {}: one of them was changed after it was signed. "
                    "Ask the issuer for all files of the certificate",
                    (directory / names.signature).string(), names.sums));
  return *sums;
}

/// A listed name has to match its own sum, whichever other file it equals.
void verify_listed(const fs::path& file, const std::string& sum) {
  if (calib::sha256(calib::read_file(file)) != sum)
    throw NotVerified(
        Why::kChangedFile,
        printable(file.string()) + ": was changed after it was signed. Ask the issuer for it");
}

/// Signed name of the file: its own, or another one where its own is not listed.
std::string verify_one(const fs::path& file, const Sums& sums) {
  const std::string name = file.filename().string();
  if (const std::string* sum = sum_of(sums, name)) {
    verify_listed(file, *sum);
    return name;
  }
  const std::string sum = calib::sha256(calib::read_file(file));
  const auto same =
      std::ranges::find(sums.files, sum, &std::pair<std::string, std::string>::second);
  if (same == sums.files.end())
    throw NotVerified(Why::kNotListed, printable(file.string()) + ": not one of the signed files");
  return same->first;
}

/// Rejects unlisted files in the directory, which would pass for signed.
void refuse_others(const fs::path& directory, Kind kind, const Sums& sums) {
  const Names own = names_of(kind);
  std::vector<std::string> others;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (name != own.sums && name != own.signature && sum_of(sums, name) == nullptr)
      others.push_back(name);
  }
  if (others.empty()) return;
  const std::string first = *std::ranges::min_element(others);
  throw NotVerified(Why::kNotListed,
                    printable((directory / first).string()) +
                        ": not signed, but in the same folder as the signed files. Remove it, or "
                        "verify single files");
}

/// Throws calib::FileError for a missing file.
fs::path folder_of(const fs::path& file) {
  std::error_code code;
  if (fs::is_directory(file, code)) return file;
  (void)calib::read_file(file);
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

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

[[noreturn]] void refuse(const fs::path& path, int error, const std::string& remedy) {
  throw KeyError(fmt::format("{}: {}. {}", path.string(), std::strerror(error), remedy));
}

class File {
 public:
  explicit File(int fd) : fd_(fd) {}
  File(const fs::path& path, int flags, const std::string& remedy)
      : File(::open(path.c_str(), flags | O_CLOEXEC)) {
    if (fd_ < 0) refuse(path, errno, remedy);
  }
  ~File() { ::close(fd_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Other rights help only where rights are missing: not against a read-only file system or a name too long.
std::string remedy_of_new(const fs::path& path, int error) {
  const fs::path folder = fs::absolute(path).parent_path();
  std::error_code code;
  if (error == EACCES || error == EPERM) return "Use sudo, or choose another place: --key FILE";
  if (fs::is_directory(folder, code)) return "Choose another place: --key FILE";
  return fmt::format("Create the folder {}, or choose another place: --key FILE", folder.string());
}

void write_new(const fs::path& path, const std::string& text, mode_t mode) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (fd < 0) {
    const int error = errno;
    refuse(path, error, remedy_of_new(path, error));
  }
  const File file(fd);
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

void sign_files(const fs::path& directory, const std::vector<std::string>& names,
                Statement statement, const PrivateKey& key, Kind kind) {
  statement.key = key.fingerprint();
  Sums sums{std::move(statement), {}};
  for (const std::string& name : names)
    sums.files.emplace_back(name, calib::sha256(calib::read_file(directory / name)));
  const std::string text = text_of(sums);
  write_atomically(directory / names_of(kind).signature, key.sign(text));
  write_atomically(directory / names_of(kind).sums, text);
}

bool has_signature(const fs::path& directory, Kind kind) {
  std::error_code code;
  return fs::exists(directory / names_of(kind).sums, code) ||
         fs::exists(directory / names_of(kind).signature, code);
}

void refuse_unsigned(const fs::path& file) {
  const fs::path directory = folder_of(file);
  if (!has_signature(directory, Kind::kExport)) (void)read_or_refuse(directory / kSums);
}

Verified verify_files(const fs::path& file, const PublicKey& key, std::optional<Kind> asked) {
  std::error_code code;
  const bool whole = fs::is_directory(file, code);
  const fs::path directory = folder_of(file);
  const bool of_export =
      !has_signature(directory, Kind::kCertificate) && has_signature(directory, Kind::kExport);
  const Kind kind = asked.value_or(of_export ? Kind::kExport : Kind::kCertificate);
  const Sums sums = signed_sums(directory, kind, key);
  Verified verified{kind, sums.statement, {}};
  if (!whole) {
    verified.files.push_back(verify_one(file, sums));
    return verified;
  }
  for (const auto& [name, sum] : sums.files) {
    const fs::path one = directory / name;
    if (!fs::exists(one, code))
      throw NotVerified(Why::kMissingFile,
                        one.string() + ": was signed, and is missing. Ask the issuer for it");
    verify_listed(one, sum);
    verified.files.push_back(name);
  }
  refuse_others(directory, kind, sums);
  return verified;
}

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
  try {
    write_new(public_part(key), public_pem(made), S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH);
  } catch (const KeyError&) {
    ::unlink(key.c_str());  // half a pair would only refuse the next attempt
    throw;
  }
}

PrivateKey::PrivateKey(const fs::path& path) {
  const File file(path, O_RDONLY | O_NONBLOCK,
                  "Choose another key with --key FILE, or give --no-sign");
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

PublicKey::PublicKey(const fs::path& path, const char* option) {
  const File file(path, O_RDONLY | O_NONBLOCK,
                  fmt::format("Give the signer's public key: {} FILE.pub", option));
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
