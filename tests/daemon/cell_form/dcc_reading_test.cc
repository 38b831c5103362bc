// Digital Calibration Certificates of laboratories, and malformed ones.

#include <gtest/gtest.h>

#include "calib/model/error.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon::testing {
namespace {

/// Expanded uncertainty 0.4 um, k = 2, in either spelling.
const std::string kOldU =
    "<si:expandedUnc><si:uncertainty>0.4</si:uncertainty><si:coverageFactor>2</si:coverageFactor>"
    "<si:coverageProbability>0.95</si:coverageProbability></si:expandedUnc>";
const std::string kNewU =
    "<si:measurementUncertaintyUnivariate><si:expandedMU><si:valueExpandedMU>0.4</si:valueExpandedMU>"
    "<si:coverageFactor>2</si:coverageFactor></si:expandedMU></si:measurementUncertaintyUnivariate>";

std::string quantity(const std::string& name, const std::string& value,
                     const std::string& uncertainty, const std::string& unit = "\\micro\\metre",
                     const std::string& attributes = "") {
  return "<dcc:quantity " + attributes + "><dcc:name><dcc:content lang=\"en\">" + name +
         "</dcc:content></dcc:name><si:real><si:value>" + value + "</si:value><si:unit>" + unit +
         "</si:unit>" + uncertainty + "</si:real></dcc:quantity>\n";
}

std::string item(const std::string& serial, const std::string& id) {
  return "<dcc:item id=\"" + id +
         "\"><dcc:name><dcc:content>ceramic sphere</dcc:content></dcc:name>" +
         "<dcc:identifications><dcc:identification><dcc:issuer>customer</dcc:issuer><dcc:value>inventory 9"
         "</dcc:value></dcc:identification><dcc:identification><dcc:issuer>manufacturer</dcc:issuer><dcc:value>" +
         serial + "</dcc:value></dcc:identification></dcc:identifications></dcc:item>\n";
}

std::string dcc(const std::string& quantities, const std::string& items = item("K-77", "item1")) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<dcc:digitalCalibrationCertificate "
         "xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\" schemaVersion=\"3.2.1\">"
         "<dcc:administrativeData><dcc:coreData><dcc:uniqueIdentifier>D-K 4711</dcc:uniqueIdentifier>"
         "<dcc:endPerformanceDate>2026-04-01</dcc:endPerformanceDate></dcc:coreData><dcc:items>" +
         items +
         "</dcc:items><dcc:calibrationLaboratory><dcc:contact><dcc:name><dcc:content>Lab 1</dcc:content></dcc:name>"
         "</dcc:contact></dcc:calibrationLaboratory></dcc:administrativeData><dcc:measurementResults>"
         "<dcc:measurementResult><dcc:influenceConditions><dcc:influenceCondition><dcc:data>" +
         quantity("diameter of the chamber", "3", "", "\\metre") +
         "</dcc:data></dcc:influenceCondition></dcc:influenceConditions><dcc:results><dcc:result>"
         "<dcc:name><dcc:content>results</dcc:content></dcc:name><dcc:data><dcc:list>\n" +
         quantities +
         "</dcc:list></dcc:data></dcc:result></dcc:results></dcc:measurementResult></dcc:measurementResults>"
         "</dcc:digitalCalibrationCertificate>";
}

std::string list_of(const std::string& name, const std::string& values, const std::string& more,
                    const std::string& unit = "\\milli\\metre") {
  return "<dcc:quantity refType=\"basic_measuredValue\"><dcc:name><dcc:content>" + name +
         "</dcc:content></dcc:name><si:realListXMLList><si:valueXMLList>" + values +
         "</si:valueXMLList><si:unitXMLList>" + unit + "</si:unitXMLList>" + more +
         "</si:realListXMLList></dcc:quantity>\n";
}

std::string expanded_mu(const std::string& values, const std::string& k) {
  return "<si:measurementUncertaintyUnivariateXMLList><si:expandedMUXMLList><si:valueExpandedMUXMLList>" +
         values + "</si:valueExpandedMUXMLList><si:coverageFactorXMLList>" + k +
         "</si:coverageFactorXMLList><si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList>"
         "</si:expandedMUXMLList></si:measurementUncertaintyUnivariateXMLList>";
}

std::string refusal(const std::string& xml, bool lengths = false) {
  try {
    if (lengths)
      (void)certificate_in(xml, "given.xml");
    else
      (void)spheres_in(xml, "given.xml");
    return "";
  } catch (const calib::FileError& refused) {
    return refused.what();
  }
}

TEST(ADcc, OfOneSphereGivesDiameterSigmaSerialNumberAndCertificate) {
  for (const std::string& u : {kOldU, kNewU}) {
    const auto spheres = spheres_in(
        dcc(quantity("nominal diameter", "50000", "") + quantity("diameter", "49998.25", u) +
            quantity("form deviation of the diameter", "0.08", u) +
            quantity("mass", "1", u, "\\kilogram")),
        "given.xml");
    ASSERT_EQ(spheres.size(), 1u);
    EXPECT_EQ(spheres[0].id, "K-77");
    EXPECT_EQ(spheres[0].serial, "K-77");
    EXPECT_DOUBLE_EQ(spheres[0].diameter_mm, 49.99825);
    EXPECT_DOUBLE_EQ(spheres[0].diameter_sigma_mm, 0.0002);
    EXPECT_EQ(spheres[0].certificate.number, "D-K 4711, Lab 1");
    EXPECT_EQ(spheres[0].certificate.date, "2026-04-01");
    EXPECT_FALSE(spheres[0].centre_mm);
  }
}

TEST(ADcc, GivesTheCellFileShortTextsOfOneLine) {
  std::string xml = dcc(quantity("diameter S1", "50001", kNewU),
                        item(std::string(5000, '7') + "\x1b[2J\n8", "item1"));
  xml.replace(xml.find("2026-04-01"), 10, "2026-04-0\x1b\n" + std::string(5000, '1'));
  const SphereForm sphere = spheres_in(xml, "given.xml").at(0);
  EXPECT_EQ(sphere.serial, std::string(60, '7'));
  EXPECT_EQ(sphere.certificate.date, "2026-04-0?");
}

TEST(ADcc, StatesLengthsInAnyMultipleOfTheMetreAndUnderAnyPrefix) {
  const auto mm_of = [](std::string xml) { return spheres_in(xml, "given.xml").at(0).diameter_mm; };
  const std::string half =
      "<si:expandedUnc><si:uncertainty>1e-9</si:uncertainty><si:coverageFactor>2"
      "</si:coverageFactor></si:expandedUnc>";
  EXPECT_DOUBLE_EQ(mm_of(dcc(quantity("diameter", "0.05", half, "\\metre"))), 50.0);
  EXPECT_DOUBLE_EQ(mm_of(dcc(quantity("Durchmesser", "50", half, "\\milli\\metre"))), 50.0);
  std::string other = dcc(quantity("diameter", "50", half, "\\milli\\metre"));
  for (std::size_t at = 0; (at = other.find("dcc:", at)) != std::string::npos;)
    other.replace(at, 4, "c:");
  EXPECT_DOUBLE_EQ(mm_of(other), 50.0);
  std::string hybrid = dcc(quantity("diameter", "50", half, "\\milli\\metre"));
  hybrid.replace(hybrid.find("<si:real><si:value>50"), 9, "<si:hybrid><si:real>");
  hybrid.replace(hybrid.find("</si:real></dcc:quantity>\n</dcc:list>"), 10,
                 "</si:real></si:hybrid>");
  EXPECT_DOUBLE_EQ(mm_of(hybrid), 50.0);
}

TEST(ADcc, OfSeveralSpheresTellsThemApartByNameOrByTheItemReferredTo) {
  const auto named = spheres_in(dcc(quantity("diameter of sphere 1", "50001", kNewU) +
                                    quantity("Durchmesser Kugel 2", "50002", kNewU) +
                                    quantity("diameter S3", "50003", kNewU)),
                                "given.xml");
  ASSERT_EQ(named.size(), 3u);
  EXPECT_EQ(named[0].id, "S1");
  EXPECT_EQ(named[1].id, "S2");
  EXPECT_EQ(named[2].id, "S3");
  const auto by_item =
      spheres_in(dcc(quantity("diameter", "50001", kNewU, "\\micro\\metre", "refId=\"a\"") +
                         quantity("diameter", "50002", kNewU, "\\micro\\metre", "refId=\"b\""),
                     item("K-1", "a") + item("K-2", "b")),
                 "given.xml");
  ASSERT_EQ(by_item.size(), 2u);
  EXPECT_EQ(by_item[0].serial, "K-1");
  EXPECT_EQ(by_item[1].id, "K-2");
}

TEST(ADcc, OfABallPlateGivesTheLengthsBetweenItsSpheres) {
  const auto lengths =
      certificate_in(dcc(quantity("diameter S1", "30000", kNewU) +
                         quantity("centre distance S1-S2", "400000.1", kNewU) +
                         quantity("distance sphere 1 to sphere 3", "500000", kNewU)),
                     "given.xml");
  ASSERT_EQ(lengths.size(), 2u);
  EXPECT_EQ(lengths[0].from, "S1");
  EXPECT_EQ(lengths[0].to, "S2");
  EXPECT_DOUBLE_EQ(lengths[0].mm, 400.0001);
  EXPECT_DOUBLE_EQ(lengths[0].sigma_mm, 0.0002);
  EXPECT_EQ(lengths[1].to, "S3");
}

TEST(ADcc, OfABallPlateMayStateCoordinatesOfItsCentresAndUncertaintiesByName) {
  const std::string plate = "<dcc:name><dcc:content>diameters and lengths</dcc:content></dcc:name>";
  const std::string xml =
      dcc(plate + quantity("diameter S1", "30000", kNewU) +
          quantity("Centre of sphere S1, x", "0.0", kNewU) +
          quantity("Centre of sphere S2, x", "12500", kNewU) +
          quantity("Centre of sphere S2, y", "-3", kNewU) +
          quantity("Distance S1-S2, U95", "400000.1", kNewU) +
          quantity("Abst\xc3\xa4nde S1-S3 (k2)", "500000", kNewU) +
          quantity("L\xc3\x84NGE S2-sphere k2", "600000", kNewU) +
          list_of("centres, x", "0.0 400.1",
                  "<si:labelXMLList>S1 S2</si:labelXMLList>" + expanded_mu("0.1", "2")));
  const auto lengths = certificate_in(xml, "given.xml");
  ASSERT_EQ(lengths.size(), 3u);
  EXPECT_EQ(lengths[0].from + lengths[0].to, "S1S2");
  EXPECT_EQ(lengths[1].from + lengths[1].to, "S1S3");
  EXPECT_EQ(lengths[2].from + lengths[2].to, "S2K2");
  const auto spheres = spheres_in(xml, "given.xml");
  ASSERT_EQ(spheres.size(), 1u);
  EXPECT_DOUBLE_EQ(spheres[0].diameter_mm, 30.0);
  EXPECT_NE(refusal(dcc(quantity("Centre of sphere S1, x", "0.0", kNewU)), true)
                .find("no distance of two centres"),
            std::string::npos);
  EXPECT_NE(refusal(dcc(quantity("distance S1-S2", "0.0", kNewU)), true)
                .find("not the distance of two centres"),
            std::string::npos);
}

TEST(ADcc, LeavesOutWhatIsNoSizeByWholeWords) {
  for (const char* kept : {"(information in annex)", "(conformity stated)", "unlimited",
                           "Benennung A7b", "performed 2026", "informal"}) {
    const auto spheres =
        spheres_in(dcc(quantity("Diameter of sphere S1", "50001", kNewU) +
                       quantity(std::string("Diameter of sphere S2 ") + kept, "50002", kNewU)),
                   "given.xml");
    EXPECT_EQ(spheres.size(), 2u) << kept;
  }
  for (const char* left :
       {"form", "Formabweichung", "Formfehler,", "nominal", "nominaler", "Nenndurchmesser",
        "Nennma\xc3\x9f", "Nennwert", "Unrundheit", "Durchmesserabweichungen", "lower limit",
        "limits", "error", "Ma\xc3\x9ftoleranz"})
    EXPECT_EQ(spheres_in(dcc(quantity("diameter S1", "50001", kNewU) +
                             quantity(std::string(left) + " diameter S2", "50002", kNewU)),
                         "given.xml")
                  .size(),
              1u)
        << left;
  for (const char* type : {"basic_nominalValue", "basic_measurementError", "geometry_formDeviation",
                           "basic_toleranceLimitUpper", "basic_limitLower"})
    EXPECT_EQ(spheres_in(dcc(quantity("diameter S1", "50001", kNewU) +
                             quantity("diameter S2", "50002", kNewU, "\\micro\\metre",
                                      "refType=\"" + std::string(type) + "\"")),
                         "given.xml")
                  .size(),
              1u)
        << type;
}

/// The name is that of the result; its quantity has none, or `own`.
std::string result(const std::string& name, const std::string& value, const std::string& own = "") {
  std::string inner = quantity(own, value, kNewU);
  if (own.empty())
    inner.replace(inner.find("<dcc:name>"), inner.find("<si:real>") - inner.find("<dcc:name>"), "");
  return "<dcc:result><dcc:name><dcc:content>" + name + "</dcc:content></dcc:name><dcc:data>" +
         inner + "</dcc:data></dcc:result>";
}

TEST(ADcc, LeavesOutDistancesThatAreNotThoseOfTwoCentres) {
  for (const char* other : {"Distance of S1 and S3, x component", "Distance S1-S3 in z",
                            "dx, distance S1-S3", "Abstand S1-S3, X-Komponente",
                            "Horizontal distance of S1 and S3", "Vertikaler Abstand S1-S3",
                            "projected length S1-S3", "Distance between the surfaces of S1 and S3",
                            "Abstand der Kugeloberfl\xc3\xa4"
                            "chen S1-S3",
                            "Inner distance S1-S3", "distance_S1_S3_x_component",
                            "Au\xc3\x9f"
                            "enabstand S1-S3"}) {
    for (const std::string& named : {quantity(other, "300000", kNewU), result(other, "300000"),
                                     result(other, "300000", "result")})
      EXPECT_EQ(
          certificate_in(dcc(quantity("distance S1-S2", "400000", kNewU) + named), "given.xml")
              .size(),
          1u)
          << other;
    const std::string words = refusal(dcc(quantity(other, "300000", kNewU)), true);
    EXPECT_NE(
        words.find(
            "no distance of two centres with an uncertainty among its results (1 other lengths, such as"),
        std::string::npos)
        << words;
  }
}

TEST(ADcc, AsksTheEnclosingNamesWhereTheQuantitysOwnDoesNotStateItsKind) {
  const auto lengths = certificate_in(dcc(result("Centre distance S1-S2", "400000") +
                                          result("Distance of S1 and S3", "500000", "value")),
                                      "given.xml");
  ASSERT_EQ(lengths.size(), 2u);
  EXPECT_EQ(lengths[1].to, "S3");
  EXPECT_NE(refusal(dcc(result("Centre distance 1-2", "400000")), true)
                .find("does not name its two spheres"),
            std::string::npos);
  const auto spheres = spheres_in(dcc(result("Roundness of diameter, sphere 1", "5000") +
                                      result("Diameter of sphere 2", "50001") +
                                      result("Sphere 3: diameter variation", "4000", "value") +
                                      result("Form and diameter of sphere 4", "50002", "diameter")),
                                  "given.xml");
  ASSERT_EQ(spheres.size(), 2u);
  EXPECT_EQ(spheres[0].id, "S2");
  EXPECT_EQ(spheres[1].id, "S4");
}

TEST(ADcc, KnowsUnitsByEitherSpellingAndBySymbolAndNamesOthers) {
  const auto mm = [](const std::string& unit) {
    return spheres_in(
               dcc(quantity(
                   "diameter", "50",
                   "<si:expandedUnc><si:uncertainty>1e-6</si:uncertainty><si:coverageFactor>2"
                   "</si:coverageFactor></si:expandedUnc>",
                   unit)),
               "given.xml")
        .at(0)
        .diameter_mm;
  };
  for (const char* unit : {"\\milli\\metre", "\\milli\\meter", "mm"})
    EXPECT_EQ(mm(unit), 50.0) << unit;
  for (const char* unit : {"\\micro\\meter", "um", "\xc2\xb5m", "\xce\xbcm"})
    EXPECT_EQ(mm(unit), 0.05) << unit;
  const std::string words =
      refusal(dcc(quantity("diameter of sphere 1", "1.5", kNewU, "inch") +
                  quantity("mass", "1", kNewU, "\\kilogram") + quantity("height", "30000", kNewU)));
  EXPECT_NE(
      words.find(
          "1 other lengths, such as \"results / height\"; \"results / diameter of sphere 1\" is in \"inch\""),
      std::string::npos)
      << words;
}

TEST(ADcc, WithOneSphereInAUnitThatIsNotReadIsRefused) {
  const std::string s1 = quantity("diameter of sphere 1", "50001", kNewU);
  const std::string words = refusal(dcc(s1 + quantity("diameter of sphere 2", "2", kNewU, "inch")));
  EXPECT_NE(words.find("sphere 2\" is in \"inch\", others in units of the SI"), std::string::npos)
      << words;
  EXPECT_EQ(spheres_in(dcc(s1 + quantity("diameter of sphere 2, drift", "2", kNewU, "\\kelvin")),
                       "given.xml")
                .size(),
            1u);
}

TEST(ADcc, MayBeInUtf16) {
  const std::string xml = dcc(quantity("Durchmesser K\xc3\xb6rper, Kugel 1", "50001", kNewU));
  const auto utf16 = [](const std::string& text, bool little) {
    std::string bytes = little ? "\xff\xfe" : "\xfe\xff";
    for (std::size_t i = 0; i < text.size(); ++i) {
      const auto lead = static_cast<unsigned char>(text[i]);
      const int c = lead < 0x80 ? lead : (lead & 0x1f) << 6 | (text[++i] & 0x3f);
      const std::string two = {static_cast<char>(c >> 8), static_cast<char>(c & 0xff)};
      bytes += little ? std::string{two[1], two[0]} : two;
    }
    return bytes;
  };
  for (const bool little : {true, false})
    EXPECT_EQ(spheres_in(utf16(xml, little), "given.xml").at(0).id, "S1");
  EXPECT_NE(
      refusal(utf16(dcc(quantity("diameter", "x", kNewU)), true)).find("given.xml:5: the value"),
      std::string::npos)
      << refusal(utf16(dcc(quantity("diameter", "x", kNewU)), true));
  EXPECT_NE(refusal("\xff\xfe<").find("UTF-16 text is damaged"), std::string::npos);
}

TEST(ADcc, ThatLeavesOpenWhichSphereAValueIsOfIsRefusedWithWhatToChoose) {
  const std::string two =
      quantity("diameter", "50001", kNewU) + quantity("diameter", "50002", kNewU);
  for (const std::string& items : {std::string(), item("K-1", "a") + item("K-2", "b")}) {
    const std::string words = refusal(dcc(two, items));
    EXPECT_NE(words.find("2 diameters"), std::string::npos) << words;
    EXPECT_NE(words.find("50.002000 mm"), std::string::npos) << words;
    EXPECT_NE(words.find("CSV"), std::string::npos) << words;
  }
  EXPECT_NE(refusal(dcc(two)).find("two diameters of K-77"), std::string::npos);
  EXPECT_NE(refusal(dcc(quantity("centre distance", "400000", kNewU)), true)
                .find("does not name its two"),
            std::string::npos);
  EXPECT_NE(refusal(dcc(quantity("distance S1-S2", "400000", kNewU) +
                        quantity("distance S2-S1", "400001", kNewU)),
                    true)
                .find("two lengths S2-S1"),
            std::string::npos);
}

TEST(ADcc, WithoutWhatASigmaNeedsIsRefusedByLine) {
  const auto with = [](const std::string& u) {
    return refusal(dcc(quantity("diameter", "50001", u)));
  };
  EXPECT_NE(with("").find("states no uncertainty"), std::string::npos);
  EXPECT_NE(with("<si:expandedUnc><si:uncertainty>1</si:uncertainty></si:expandedUnc>")
                .find("coverageFactor"),
            std::string::npos);
  EXPECT_NE(
      with(
          "<si:expandedUnc><si:uncertainty>1</si:uncertainty><si:coverageFactor>0</si:coverageFactor>"
          "</si:expandedUnc>")
          .find("given.xml:5: the coverage factor"),
      std::string::npos);
  for (const char* bad : {"nan", "inf", "-1", "1,5", "1e999", ""})
    EXPECT_NE(with(std::string("<si:expandedUnc><si:uncertainty>") + bad +
                   "</si:uncertainty><si:coverageFactor>2</si:coverageFactor></si:expandedUnc>"),
              "")
        << bad;
  EXPECT_NE(
      refusal(dcc(quantity("diameter", "50", kNewU, "\\metre"))).find("above any certificate"),
      std::string::npos);
  EXPECT_NE(refusal(dcc(quantity("diameter", "0", kNewU))).find("not the diameter"),
            std::string::npos);
}

TEST(ADcc, WithSeveralValuesInOneListTellsThemApartByTheNamesInItsName) {
  const auto spheres = spheres_in(dcc(list_of("diameters S1, S2, S4", "38.1001 38.0998 25.4",
                                              expanded_mu("0.0004 0.0006 0.001", "2"))),
                                  "given.xml");
  ASSERT_EQ(spheres.size(), 3u);
  EXPECT_EQ(spheres[1].id, "S2");
  EXPECT_DOUBLE_EQ(spheres[1].diameter_mm, 38.0998);
  EXPECT_DOUBLE_EQ(spheres[1].diameter_sigma_mm, 0.0003);
  EXPECT_EQ(spheres[2].id, "S4");
  EXPECT_EQ(spheres[0].certificate.date, "2026-04-01");
  EXPECT_EQ(spheres[0].serial, "") << "the item's number is not that of three spheres";
}

TEST(ADcc, WithSeveralValuesInOneListTellsThemApartByLabelsOrByAColumnBesideIt) {
  const auto labelled = certificate_in(
      dcc(list_of(
          "distances of the centres", "400.1 300.2",
          "<si:labelXMLList>S1-S2 S1-S3</si:labelXMLList><si:expandedUncXMLList><si:uncertaintyXMLList>"
          "0.002</si:uncertaintyXMLList><si:coverageFactorXMLList>2 2</si:coverageFactorXMLList>"
          "</si:expandedUncXMLList>")),
      "given.xml");
  ASSERT_EQ(labelled.size(), 2u);
  EXPECT_EQ(labelled[1].to, "S3");
  EXPECT_DOUBLE_EQ(labelled[1].mm, 300.2);
  EXPECT_DOUBLE_EQ(labelled[1].sigma_mm, 0.001);
  const auto beside = spheres_in(
      dcc("<dcc:quantity><dcc:charsXMLList>S3 S5</dcc:charsXMLList></dcc:quantity>" +
          list_of("diameter", "0.025 0.0381", expanded_mu("4e-7 6e-7", "2 2"), "\\metre \\metre")),
      "given.xml");
  ASSERT_EQ(beside.size(), 2u);
  EXPECT_EQ(beside[1].id, "S5");
  EXPECT_DOUBLE_EQ(beside[1].diameter_mm, 38.1);
  EXPECT_NEAR(beside[1].diameter_sigma_mm, 0.0003, 1e-12);
}

TEST(ADcc, WhoseListIsNotOfOnePieceIsRefused) {
  EXPECT_NE(
      refusal(dcc(list_of("diameters", "38.1 25.4", expanded_mu("0.0004", "2")))).find("Choose"),
      std::string::npos)
      << "nothing tells the two apart";
  EXPECT_NE(refusal(dcc(list_of("diameters S1 S2 S3", "38 25 19", expanded_mu("0.1 0.2", "2"))))
                .find("the uncertainty: 2 for 3 values of the list"),
            std::string::npos);
  EXPECT_NE(refusal(dcc(list_of("diameters S1 S2", "38 x", expanded_mu("0.1", "2"))))
                .find("not a number"),
            std::string::npos);
  EXPECT_NE(
      refusal(dcc(list_of("diameters S1 S2", "", expanded_mu("0.1", "2")))).find("without values"),
      std::string::npos);
  EXPECT_NE(refusal(dcc(list_of("diameters S1 S2", "38 25", ""))).find("states no uncertainty"),
            std::string::npos);
  std::string many;
  for (int i = 0; i < 1001; ++i) many += "38 ";
  EXPECT_NE(
      refusal(dcc(list_of("diameters", many, expanded_mu("0.1", "2")))).find("more than 1000"),
      std::string::npos);
}

TEST(ForeignXml, IsRefusedByNameAndNoEntityIsExpanded) {
  EXPECT_NE(refusal("<robot/>").find("no Digital Calibration Certificate"), std::string::npos);
  EXPECT_NE(refusal("<dcc:digitalCalibrationCertificate>").find("is not XML"), std::string::npos);
  EXPECT_NE(refusal(dcc("")).find("no diameter"), std::string::npos);
  const std::string bomb =
      "<!DOCTYPE d [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\"><!ENTITY c SYSTEM \"file:///etc/passwd\">]>" +
      dcc(quantity("diameter S1 &b; &c;", "50001", kNewU))
          .substr(std::string("<?xml version=\"1.0\" encoding=\"UTF-8\"?>").size());
  EXPECT_EQ(spheres_in(bomb, "given.xml").at(0).id, "S1");
  std::string deep;
  for (int i = 0; i < 100; ++i) deep += "<dcc:list>";
  deep += quantity("diameter", "50001", kNewU);
  for (int i = 0; i < 100; ++i) deep += "</dcc:list>";
  EXPECT_NE(refusal(dcc(deep)).find("nested deeper"), std::string::npos);
  EXPECT_NE(refusal("<" + std::string(17u << 20, 'x')).find("16 MB"), std::string::npos);
  std::string many;
  for (int i = 0; i < 1001; ++i) many += quantity("diameter", "50001", kNewU);
  EXPECT_NE(refusal(dcc(many)).find("1000"), std::string::npos);
  const std::string whole = dcc(quantity("diameter of sphere 1", "50001", kNewU));
  for (std::size_t end = 1; end < whole.size(); end += 37)
    EXPECT_NE(refusal(whole.substr(0, end)), "") << end;
}

}  // namespace
}  // namespace cellcal::daemon::testing
