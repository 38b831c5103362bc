#pragma once
// Network namespaces of this program's own: the plant's, in which it is from then on, one for cells and one for collectors, each
// joined to the plant by a pair of virtual cables that can be cut.

#include <array>
#include <functional>
#include <memory>
#include <string>

namespace cellcal::daemon::fleet::testing {

class Wires {
 public:
  enum class Side { kCells, kCollectors };
  enum class Cut {
    kClean,  ///< the side's interface is down: it knows at once
    kSilent  ///< frames go to an address that nobody has, both ways: it has to find out
  };

  /// Before any thread was started. Null where it is not allowed; `why_not` says it in a line.
  static std::unique_ptr<Wires> lay(std::string& why_not);
  ~Wires();
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  /// The plant's address as that side knows it.
  static std::string plant(Side side);
  /// With the calling thread on that side: what it starts is there, and stays.
  void within(Side side, const std::function<void()>& start) const;
  void cut(Side side, Cut how) const;
  void mend(Side side) const;

 private:
  Wires() = default;

  int plant_ = -1;
  std::array<int, 2> sides_{-1, -1};
};

}  // namespace cellcal::daemon::fleet::testing
