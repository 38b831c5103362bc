#include <gtest/gtest.h>

#include <utility>

#include "calib/model/error.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon::testing {
namespace {

std::string refusal_of_list(const std::string& csv, bool certificate = false) {
  try {
    if (certificate)
      (void)certificate_in(csv, "given");
    else
      (void)spheres_in(csv, "given");
    return "";
  } catch (const calib::FileError& refused) {
    return refused.what();
  }
}

TEST(Lists, HaveWhatACertificateSaysOfEachSphereAndDistance) {
  const auto spheres = spheres_in(
      "id,diameter_mm,diameter_sigma_mm,serial,certificate,certificate_date\nS1,49.998,0.0005,77,DKD-1,2026-04-01\nS2,50,,,,\n",
      "given");
  ASSERT_EQ(spheres.size(), 2u);
  EXPECT_EQ(spheres[0].serial, "77");
  EXPECT_EQ(spheres[0].certificate.date, "2026-04-01");
  EXPECT_EQ(spheres[1].diameter_sigma_mm, 0.002) << "where nothing is stated";
  EXPECT_FALSE(spheres[1].centre_mm);
  const auto lengths =
      certificate_in("from,to,mm,sigma_mm,certificate\nS1,S2,600.01,0.002,DKD-1\n", "given");
  EXPECT_EQ(lengths[0].certificate.number, "DKD-1");
}

TEST(Lists, WithASigmaInMicrometresAreRefusedByLineUnlessTheColumnSaysSo) {
  for (const auto& [csv, lengths] :
       {std::pair{"from,to,mm,sigma_mm\nS1,S2,600,0.002\nS1,S3,600.01,4\n", true},
        std::pair{"id,diameter_mm,diameter_sigma_mm\nS1,50,0.5\nS2,50,4\n", false}}) {
    const std::string words = refusal_of_list(csv, lengths);
    EXPECT_NE(words.find("given:3: "), std::string::npos) << words;
    EXPECT_NE(words.find("[um]"), std::string::npos) << words;
  }
  EXPECT_EQ(certificate_in("from,to,mm,sigma [um]\nS1,S2,600,4\n", "given").at(0).sigma_mm, 4e-3);
}

TEST(Lists, ThatAreWrongAreRefusedByLineAndColumn) {
  EXPECT_NE(refusal_of_list("id,diameter_mm\nS1,x\n").find("given:2: diameter_mm"),
            std::string::npos);
  EXPECT_NE(refusal_of_list("id\nS1\n").find("diameter_mm"), std::string::npos);
  EXPECT_NE(refusal_of_list("id,diameter_mm,x_mm,y_mm,z_mm\nS1,50,1,,3\n").find("all three"),
            std::string::npos);
  EXPECT_NE(refusal_of_list("id,diameter_mm\nS1,1e999\n"), "");
  EXPECT_NE(refusal_of_list("from,to,mm\nS1,S2,3\n", true).find("sigma_mm"), std::string::npos);
  EXPECT_NE(refusal_of_list("id,diameter_mm\n").find("no row"), std::string::npos);
  EXPECT_NE(refusal_of_list(""), "");
  EXPECT_NE(refusal_of_list(std::string(2u << 20, 'x')).find("1 MB"), std::string::npos);
  std::string many = "id,diameter_mm\n";
  for (int i = 0; i < 1001; ++i) many += "S,50\n";
  EXPECT_NE(refusal_of_list(many).find("1000 rows"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
