#pragma once
// Splits a TCP stream of EKI into XML documents: from the '<' of a root element to its closing tag.
// TCP has no message boundaries; documents arrive in fragments and several at once.
//
// Assumption: KUKA's documents contain neither comments nor CDATA, so the first closing tag with
// the root's name is the root's. If that fails the piece is not well-formed, which the parser
// reports. Hostile input yields a value; nothing allocates or throws.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace cellcal::drivers {

/// Largest document accepted. Actual ones have 0.3 to 1 kB.
inline constexpr std::size_t kMaxEkiDocument = 8192;

class EkiFramer {
 public:
  enum class Event {
    kNone,
    kDocument,   ///< document() is complete
    kOversized,  ///< no end within kMaxEkiDocument bytes: synchronisation is lost
  };

  Event push(char c);
  /// After kDocument, until the next push().
  std::string_view document() const { return {bytes_.data(), size_}; }
  /// A new connection.
  void reset();
  /// Bytes outside documents other than white space, prolog or NUL padding.
  std::uint64_t garbage() const { return garbage_; }

 private:
  enum class State { kOutside, kOpened, kProlog, kName, kRootTag, kBody, kBodyTag, kClosing };

  Event keep(char c);
  Event on_root_tag(char c);
  Event on_closing(char c);
  std::string_view name() const { return {bytes_.data() + 1, name_size_}; }

  std::array<char, kMaxEkiDocument> bytes_{};
  std::size_t size_ = 0, name_size_ = 0, matched_ = 0, skipped_ = 0;
  State state_ = State::kOutside;
  char quote_ = '\0', last_ = '\0';
  std::uint64_t garbage_ = 0;
};

}  // namespace cellcal::drivers
