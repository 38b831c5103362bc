// The Digital Calibration Certificate as read by its schema.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <pugixml.hpp>

#include "daemon/certificate/certificate.h"
#include "tests/daemon/certificate/origins.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using certificate::CertificateData, certificate::Entry;

CertificateData first_of_dcc() { return make_certificate(recorded().first, "e", kIssue); }

struct Dcc {
  explicit Dcc(const CertificateData& data) {
    const std::string text = to_dcc(data);
    EXPECT_TRUE(document.load_buffer(text.data(), text.size())) << text;
    root = document.child("dcc:digitalCalibrationCertificate");
  }
  std::string text(const char* path) const { return root.select_node(path).node().text().get(); }
  pugi::xml_document document;
  pugi::xml_node root;
};

std::string name_of(pugi::xml_node node) {
  return node.child("dcc:name").child("dcc:content").text().get();
}

pugi::xml_node quantity(const Dcc& dcc, const char* result, const std::string& name) {
  for (const auto& one : dcc.root.select_nodes("//dcc:result"))
    if (name_of(one.node()) == result)
      for (const auto& each : one.node().child("dcc:data").children("dcc:quantity"))
        if (name_of(each) == name) return each;
  return {};
}

TEST(ADigitalCertificate, NamesRobotArtefactsAndDates) {
  const CertificateData data = first_of_dcc();
  const Dcc dcc(data);
  EXPECT_STREQ(dcc.root.attribute("schemaVersion").value(), "3.1.2");
  const std::string core = "dcc:administrativeData/dcc:coreData/";
  EXPECT_EQ(dcc.text((core + "dcc:uniqueIdentifier").c_str()), data.entry("number").text);
  EXPECT_EQ(dcc.text((core + "dcc:beginPerformanceDate").c_str()),
            data.entry("began").text.substr(0, 10));
  EXPECT_EQ(dcc.text("//dcc:item//dcc:identification/dcc:value"), "4711");
  EXPECT_EQ(dcc.text("//dcc:measuringEquipment//dcc:value"), "K 1");
  EXPECT_EQ(dcc.text("//dcc:statement/dcc:conformity"), "pass");
  EXPECT_EQ(dcc.text("//dcc:influenceCondition//si:unit"), "\\degreecelsius");
}

TEST(ADigitalCertificate, HasTheCertificatesNumbersWithFullPrecision) {
  const CertificateData data = first_of_dcc();
  const Dcc dcc(data);
  const std::string id = "say.certificate.tcp.mean", what = calib::words(calib::Phrase(id));
  const auto figure = figure_of(data, id);
  for (const auto& [result, key] :
       {std::pair("as found", "as_found"), std::pair("as left", "as_left")}) {
    const pugi::xml_node real = quantity(dcc, result, what).child("si:real");
    EXPECT_EQ(real.child("si:value").text().as_double(), figure[key]["value"]) << result;
    EXPECT_STREQ(real.child("si:unit").text().get(), "\\milli\\metre");
  }
  for (const auto& parameter : data.content["parameters"]) {
    const std::string name = parameter["name"]["text"];
    const pugi::xml_node real =
        quantity(dcc, "corrections of the arm's parameters", name).child("si:real");
    ASSERT_TRUE(real) << name << " in " << parameter["correction"];
    EXPECT_EQ(real.child("si:value").text().as_double(), parameter["correction"]["value"]);
    const pugi::xml_node expanded = real.child("si:expandedUnc");
    EXPECT_EQ(expanded.child("si:uncertainty").text().as_double(), parameter["expanded"]["value"]);
    EXPECT_EQ(expanded.child("si:coverageFactor").text().as_double(), 2.0);
  }
}

/// The schema requires sequences: elements in another order are refused.
TEST(ADigitalCertificate, KeepsTheOrderOfTheSchema) {
  const Dcc dcc(first_of_dcc());
  const auto children = [&](const char* path) {
    std::string all;
    for (const auto& child : dcc.root.select_node(path).node().children())
      if (!all.ends_with(std::string(child.name()) + " ")) all += std::string(child.name()) + " ";
    return all;
  };
  EXPECT_EQ(children("."), "dcc:administrativeData dcc:measurementResults ");
  EXPECT_EQ(children("dcc:administrativeData/dcc:coreData"),
            "dcc:countryCodeISO3166_1 dcc:usedLangCodeISO639_1 dcc:mandatoryLangCodeISO639_1 "
            "dcc:uniqueIdentifier dcc:identifications dcc:beginPerformanceDate "
            "dcc:endPerformanceDate dcc:performanceLocation ");
  EXPECT_EQ(children("//dcc:measurementResult"),
            "dcc:name dcc:usedMethods dcc:usedSoftware dcc:measuringEquipments "
            "dcc:influenceConditions dcc:results ");
  EXPECT_EQ(children("//dcc:item"), "dcc:name dcc:manufacturer dcc:model dcc:identifications ");
  EXPECT_EQ(children("//dcc:calibrationLaboratory/dcc:contact"),
            "dcc:name dcc:eMail dcc:location ");
  EXPECT_EQ(children("//si:real"), "si:value si:unit ");
}

/// PTB's dcc.xsd, which imports SI_Format.xsd from its folder, is not part of the source tree.
TEST(ADigitalCertificate, IsValidByTheSchemaWhereCELLCALDCCXSDNamesIt) {
  const char* schema = std::getenv("CELLCAL_DCC_XSD");
  if (schema == nullptr) GTEST_SKIP() << "CELLCAL_DCC_XSD is not set";
  const TemporaryDirectory dir;
  for (const Archive* from : {&recorded().first, &recorded().second}) {
    std::ofstream(dir / "c.xml") << to_dcc(make_certificate(*from, "e", kIssue));
    const Outcome checked =
        run_program({"/usr/bin/xmllint", "--noout", "--schema", schema, dir / "c.xml"});
    EXPECT_EQ(checked.status, 0) << checked.err;
  }
}

TEST(ADigitalCertificate, TakesNamesOfAnyTextAndFilesThatStateNothing) {
  CertificateData data = make_certificate(recorded().second, "e", kIssue);
  auto& content = data.content;
  content["robot"]["text"] = "<dcc:item/>&\"']]>\xC3\xA4";
  content["issued_by"] = Entry();
  content["decision"] = nullptr;
  content["lengths"].clear();
  content["artefacts"].clear();
  content["parameters"][0]["correction"]["unit"] = "furlong";
  const Dcc dcc(data);
  EXPECT_EQ(dcc.text("//dcc:item/dcc:model"), data.entry("robot").text);
  EXPECT_EQ(dcc.text("//dcc:calibrationLaboratory//dcc:name/dcc:content"), "not stated");
  EXPECT_FALSE(dcc.root.select_node("//dcc:conformity").node());
  EXPECT_TRUE(dcc.root.select_node("//dcc:measuringEquipment").node()) << "one is required";
  EXPECT_TRUE(
      quantity(dcc, "corrections of the arm's parameters", data.entry("parameters/0/name").text)
          .child("dcc:noQuantity"))
      << "D-SI has no such unit";
}

}  // namespace
}  // namespace cellcal::daemon::testing
