// Truncated, mutated or garbage programs result in a corrected program, in refusals or in an error
// that names the file.

#include <gtest/gtest.h>

#include <set>

#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

/// A corrected program is complete: the same number of bytes outside of numbers.
void survive(const krl::ProgramFiles& f) {
  static const calib::Calibration c = [] {
    calib::Calibration without_bound = calibration();
    without_bound.covariance.resize(0, 0);  // the slowest part
    return without_bound;
  }();
  try {
    const auto result = correct_program(c, f);
    EXPECT_EQ(result.files.empty(), !result.refusals.empty());
    for (const krl::Refusal& one : result.refusals) EXPECT_NE(words(one, cell().robot), "");
  } catch (const calib::FileError& error) {
    std::set<std::string> names{f.src.name};
    if (f.dat) names.insert(f.dat->name);
    for (const krl::KrlFile& file : f.controller) names.insert(file.name);
    EXPECT_TRUE(names.contains(error.file)) << error.what();
  }
}

TEST(AProgramThatWasCutOff, IsCorrectedOrRefused) {
  const krl::ProgramFiles whole = files(taught(cell().robot, frames(), postures(2)));
  for (std::size_t cut = 0; cut < whole.dat->text.size(); cut += 3) {
    krl::ProgramFiles f = whole;
    f.dat->text.resize(cut);
    survive(f);
  }
  for (std::size_t cut = 0; cut < whole.src.text.size(); cut += 23) {
    krl::ProgramFiles f = whole;
    f.src.text.resize(cut);
    survive(f);
  }
}

TEST(AProgramWithBytesChanged, IsCorrectedOrRefused) {
  const krl::ProgramFiles whole = files(taught(cell().robot, frames(), postures(2)));
  calib::Random random(7);
  const std::string odd =
      "{}[]=,:;.\"'-+eE9$#\t\r\n\xff"
      "a(";
  for (int k = 0; k < 1500; ++k) {
    krl::ProgramFiles f = whole;
    std::string* const texts[] = {&f.src.text, &f.dat->text, &f.controller[0].text};
    std::string& text = *texts[k % 3];
    for (int n = 0; n < 3; ++n)
      text[static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(text.size()) - 1.0))] =
          odd[static_cast<std::size_t>(
              random.uniform(0.0, static_cast<double>(odd.size()) - 0.01))];
    survive(f);
  }
}

TEST(NumbersThatAreNone, AreRefused) {
  const krl::ProgramFiles whole = files(taught(cell().robot, frames(), postures(1)));
  for (const char* bad : {"1e400", "-1e400", "nan", "inf", "1.2.3", "99999999999", "--1", "'HFF'",
                          "{", "1e", "0x10", "1,5"}) {
    krl::ProgramFiles f = whole;
    const auto at = f.dat->text.find("={X ") + 4;
    f.dat->text.replace(at, f.dat->text.find(',', at) - at, bad);
    const auto result = correct_program(calibration(), f);
    EXPECT_FALSE(result.refusals.empty()) << bad;
    EXPECT_TRUE(result.files.empty()) << bad;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
