#include "calib/files/priors_file.h"

#include <gtest/gtest.h>

#include <string>

#include "calib/model/error.h"
#include "tests/calib/priors/simulated_fleet.h"

namespace cellcal::calib::testing {
namespace {

std::string good_file() {
  FleetPriors priors = learn(drawn_robot(), evidence_of_all(fleet_of(6, uneven()))).priors;
  priors.version = 3;
  priors.made = "2026-11-22T20:15:00Z";
  return priors_to_toml(priors);
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

std::string refusal(const std::string& text) {
  try {
    (void)parse_priors(text, "priors.toml");
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

/// The complete line with this beginning.
std::string line_of(const std::string& text, const std::string& key) {
  const auto begin = text.find("\n" + key + " = ") + 1;
  return text.substr(begin, text.find('\n', begin) - begin);
}

TEST(PriorsFile, ReadsAsItWasWritten) {
  const std::string text = good_file();
  const FleetPriors priors = parse_priors(text, "priors.toml");
  EXPECT_EQ(priors.version, 3);
  EXPECT_EQ(priors.made, "2026-11-22T20:15:00Z");
  EXPECT_EQ(priors.arms, 6);
  EXPECT_EQ(priors.joints.size(), 6u);
  EXPECT_EQ(priors_to_toml(priors), text);
}

TEST(PriorsFile, NamesLineAndKeyOfWhatIsWrong) {
  const std::string text = good_file();
  const std::string length = line_of(text, "length_mm");
  for (const char* value : {"nan", "inf", "-1.0", "0.0", "1e300", "\"0.4\"", "[0.4]"}) {
    const std::string why = refusal(with(text, length, std::string("length_mm = ") + value));
    EXPECT_NE(why.find("priors.toml:"), std::string::npos) << value;
    EXPECT_NE(why.find("length_mm"), std::string::npos) << value << ": " << why;
  }
  const std::string sigma = line_of(text, "length_sigma_mm");
  EXPECT_NE(refusal(with(text, sigma + "\n", "")).find("length_sigma_mm"), std::string::npos);
  EXPECT_NE(refusal(with(text, sigma, "length_sigma_mm = 900.0")), "")
      << "offered would be anything";
  EXPECT_NE(refusal(with(text, "name = \"A2\"", "name = \"A1\"")).find("occurs twice"),
            std::string::npos);
  EXPECT_NE(refusal(with(text, "priors/1", "priors/2")).find("format"), std::string::npos);
  EXPECT_NE(refusal(with(text, "arms = 6", "arms = 0")).find("arms"), std::string::npos);
  EXPECT_NE(refusal(with(text, line_of(text, "drawing"), "drawing = \"1234\"")).find("drawing"),
            std::string::npos);
  EXPECT_NE(refusal(with(text, "version = 3", "version = 3\nlengths = 1")).find("lengths"),
            std::string::npos);
}

TEST(PriorsFile, CutOffAnywhereIsRefusedOrHasFewerJoints) {
  const std::string text = good_file();
  for (std::size_t end = 0; end + 1 < text.size(); end += 37) {
    try {
      EXPECT_LE(parse_priors(text.substr(0, end), "cut.toml").joints.size(), 6u);
    } catch (const FileError&) {
    }
  }
}

TEST(PriorsFile, ThatIsTooLargeOrHasTooManyJointsIsRefused) {
  EXPECT_NE(refusal(std::string((1u << 20) + 1, '#')).find("bytes"), std::string::npos);
  std::string text = good_file();
  for (int k = 0; k < 40; ++k) text += "\n[[joint]]\nname = \"B" + std::to_string(k) + "\"\n";
  EXPECT_NE(refusal(text).find("46"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::calib::testing
