#include <unistd.h>

#include <fstream>

#include "daemon/doctor/wires.h"
#include "tests/daemon/doctor/outcome_of.h"

namespace cellcal::daemon::testing {
namespace {

namespace fs = std::filesystem;

/// /sys of a computer with one serial adapter, as laid out by the kernel.
class Tree {
 public:
  Tree() : root_(fs::path(::testing::TempDir()) / ("sysfs" + std::to_string(::getpid()))) {
    fs::remove_all(root_);
    fs::create_directories(root_ / "class/tty");
  }
  ~Tree() { fs::remove_all(root_); }

  /// usb-serial attaches the tty to a port of the interface, cdc_acm to the interface itself.
  void plug(const std::string& tty, const std::string& vendor, const std::string& product,
            const std::string& name, const std::string& latency = {}) {
    const fs::path usb = root_ / "devices/pci0000:00/0000:00:14.0/usb1/1-2";
    const bool acm = tty.find("ACM") != std::string::npos;
    const fs::path port = acm ? usb / "1-2:1.0" : usb / "1-2:1.0" / tty;
    fs::create_directories(port / "tty" / tty);
    write(usb / "idVendor", vendor);
    write(usb / "idProduct", product);
    write(usb / "product", name);
    if (!latency.empty()) write(port / "latency_timer", latency);
    fs::create_symlink(port, port / "tty" / tty / "device");
    fs::create_symlink(port / "tty" / tty, root_ / "class/tty" / tty);
  }
  void name_node(const std::string& bus, const std::string& device) {
    const fs::path usb = root_ / "devices/pci0000:00/0000:00:14.0/usb1/1-2";
    write(usb / "busnum", std::to_string(std::stoi(bus)));
    write(usb / "devnum", std::to_string(std::stoi(device)));
    fs::create_directories(root_ / "bus/usb/devices");
    fs::create_symlink(usb, root_ / "bus/usb/devices/1-2");
  }
  static void write(const fs::path& file, const std::string& text) {
    std::ofstream(file) << text << '\n';
  }
  testing::Said judged(const std::string& device, int baud = 1'000'000) const {
    Findings findings;
    judge_adapter(device, drivers::adapter_of(device, root_), baud, findings);
    expect_advice(findings);
    return finding_of(findings, "contact adapter");
  }
  const fs::path& root() const { return root_; }

 private:
  fs::path root_;
};

TEST(AUsbAdapter, OfAnUnoIsOk) {
  Tree tree;
  tree.plug("ttyACM0", "2341", "0043", "Arduino Uno");
  EXPECT_EQ(tree.judged("/dev/ttyACM0").outcome, Outcome::kOk);
}

TEST(AUsbAdapter, OfFtdiWithItsDefaultTimerFailsByTheTimeThatItTakes) {
  Tree tree;
  tree.plug("ttyUSB0", "0403", "6001", "FT232R USB UART", "16");
  const auto found = tree.judged("/dev/ttyUSB0");
  EXPECT_EQ(found.outcome, Outcome::kFailed);
  EXPECT_NE(found.found.find("36 ms"), std::string::npos) << found.found;
  EXPECT_NE(found.advice.find("ttyUSB0/device/latency_timer"), std::string::npos);
}

TEST(AUsbAdapter, OfFtdiIsJudgedByTheTimerThatIsReadBack) {
  Tree tree;
  tree.plug("ttyUSB0", "0403", "6015", "FT231X USB UART", "1");
  EXPECT_EQ(tree.judged("/dev/ttyUSB0").outcome, Outcome::kOk);
  for (const auto& [ms, outcome] : {std::pair{"4", Outcome::kWarning}, {"5", Outcome::kFailed}}) {
    Tree other;
    other.plug("ttyUSB0", "0403", "6015", "FT231X USB UART", ms);
    EXPECT_EQ(other.judged("/dev/ttyUSB0").outcome, outcome) << ms;
  }
}

TEST(AUsbAdapter, OfTheOlderCp210xHasNoMegabaudAndWorksSlower) {
  for (const char* name : {"CP2102 USB to UART Bridge Controller", "CP2103", ""}) {
    Tree tree;
    tree.plug("ttyUSB0", "10c4", "ea60", name);
    const auto found = tree.judged("/dev/ttyUSB0");
    EXPECT_EQ(found.outcome, Outcome::kFailed) << name;
    EXPECT_NE(found.advice.find("250000"), std::string::npos);
    EXPECT_EQ(tree.judged("/dev/ttyUSB0", 250'000).outcome, Outcome::kOk) << name;
  }
  Tree newer;
  newer.plug("ttyUSB0", "10c4", "ea60", "CP2102N USB to UART Bridge Controller");
  EXPECT_EQ(newer.judged("/dev/ttyUSB0").outcome, Outcome::kWarning);
}

TEST(AUsbAdapter, ThatNobodyKnowsIsAWarningAndNotOk) {
  for (const auto& [vendor, product] :
       {std::pair{"067b", "2303"}, {"2341", "8036"}, {"1234", "5678"}}) {
    Tree tree;
    tree.plug("ttyUSB0", vendor, product, "something");
    EXPECT_EQ(tree.judged("/dev/ttyUSB0").outcome, Outcome::kWarning) << vendor;
  }
}

TEST(AUsbAdapter, IsFoundBehindTheLinkOfTheUdevRule) {
  Tree tree;
  tree.plug("ttyUSB3", "1a86", "7523", "USB Serial");
  const fs::path device = tree.root() / "dev";
  fs::create_directories(device);
  Tree::write(device / "ttyUSB3", "");
  fs::create_symlink("ttyUSB3", device / "cellcal-contact");
  EXPECT_EQ(tree.judged((device / "cellcal-contact").string()).outcome, Outcome::kOk);
}

TEST(AUsbAdapter, IsFoundBehindItsOwnNode) {
  Tree tree;
  tree.plug("ttyUSB0", "0403", "6001", "FT232R USB UART", "16");
  tree.name_node("001", "007");
  const auto found = tree.judged("/dev/bus/usb/001/007");
  EXPECT_EQ(found.outcome, Outcome::kOk) << "opening it sets the timer";
  EXPECT_NE(found.found.find("FT232R"), std::string::npos) << found.found;
  EXPECT_EQ(tree.judged("/dev/bus/usb/001/008").outcome, Outcome::kSkipped);
}

TEST(AUsbAdapter, ThatIsNoneOrWhoseTreeIsOddIsSkipped) {
  Tree tree;
  EXPECT_EQ(tree.judged("/dev/pts/3").outcome, Outcome::kSkipped);
  EXPECT_EQ(tree.judged("").outcome, Outcome::kSkipped);
  EXPECT_EQ(tree.judged("../../..").outcome, Outcome::kSkipped);
  tree.plug("ttyUSB0", "not hex", "", std::string(100'000, 'x'), "-7");
  EXPECT_EQ(tree.judged("/dev/ttyUSB0").outcome, Outcome::kSkipped);
}

}  // namespace
}  // namespace cellcal::daemon::testing
