#pragma once
// Network namespaces of this program: the plant's, which it enters, one for cells and one for collectors, each joined to the
// plant by a pair of virtual cables that can be cut.

#include <array>
#include <functional>
#include <memory>
#include <string>

namespace cellcal::daemon::fleet::testing {

class Wires {
 public:
  enum class Side { kCells, kCollectors };
  enum class Cut {
    kClean,  ///< the side's interface is down, which it notices immediately
    kSilent  ///< frames go to an unused address, both ways: it must time out
  };

  /// To be called before any thread is started. Null if not permitted; `why_not` states the reason.
  static std::unique_ptr<Wires> lay(std::string& why_not);
  ~Wires();
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  /// The plant's address as seen from that side.
  static std::string plant(Side side);
  /// With the calling thread on that side: what it starts remains there.
  void within(Side side, const std::function<void()>& start) const;
  void cut(Side side, Cut how) const;
  void mend(Side side) const;

 private:
  Wires() = default;

  int plant_ = -1;
  std::array<int, 2> sides_{-1, -1};
};

}  // namespace cellcal::daemon::fleet::testing
