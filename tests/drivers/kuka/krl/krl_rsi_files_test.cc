// RSI's controller files: checked statically, since no controller reads them here.

#include <gtest/gtest.h>

#include <map>
#include <pugixml.hpp>
#include <regex>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/rsi_program.h"
#include "tests/drivers/kuka/krl/krl_checker.h"

namespace cellcal::drivers {
namespace {

using krl::body;
using krl::check_krl;
using krl::code_lines;
using krl::line_of;

RsiFilesConfig some_pc(int version) {
  RsiFilesConfig config;
  config.pc_address = "192.168.1.10";
  config.rsi_version = version;
  config.correction_limit_deg = 45.5;
  return config;
}

TEST(RsiFiles, AreSoundKrlAndXml) {
  for (const int version : {3, 4, 5, 6}) {
    const ControllerFiles files = rsi_files(some_pc(version));
    EXPECT_EQ(files.size(), version == 3 ? 5u : 3u);
    for (const auto& [name, text] : files) {
      EXPECT_EQ(text.substr(text.size() - 2), "\r\n");
      EXPECT_FALSE(std::regex_search(text, std::regex("@[A-Z0-9_]+@"))) << name;
      if (name.ends_with(".src")) {
        EXPECT_NO_THROW(sim::RsiProgram{text}) << name;
        for (const std::string& complaint : check_krl(text)) ADD_FAILURE() << name << complaint;
      } else {
        pugi::xml_document document;
        EXPECT_TRUE(document.load_buffer(text.data(), text.size())) << name;
      }
    }
    // With its extension for RSI 3, without it from RSI 4 on: otherwise the file is not found.
    const std::string create = version == 3   ? "RSI_CREATE(\"cellcal_rsi.rsi\""
                               : version == 6 ? "RSI_LOAD(\"cellcal_rsi\")"
                                              : "RSI_CREATE(\"cellcal_rsi\"";
    const char* on = version == 6 ? "RSI_PROCESS_ON(#ABSOLUTE)" : "RSI_ON(#ABSOLUTE,#IPO_FAST)";
    EXPECT_NE(files.at("cellcal_rsi.src").find(create), std::string::npos);
    EXPECT_NE(files.at("cellcal_rsi.src").find(on), std::string::npos);
  }
}

TEST(RsiFiles, OfRsi5AreThoseOfRsi4) { EXPECT_EQ(rsi_files(some_pc(5)), rsi_files(some_pc(4))); }

TEST(RsiFiles, OfRsi6LoadFenceActivateAndSwitchOnInThisOrderWithoutACallOfOlderReleases) {
  const std::string source = rsi_files(some_pc(6)).at("cellcal_rsi.src");
  const std::vector<std::string> main = body(source, "DEF CELLCAL_RSI");
  std::size_t at = 0;
  for (const char* line :
       {"RET=RSI_LOAD(\"cellcal_rsi\")", "IF RET<>RSIOK THEN", "IF CC_FENCE( )==FALSE THEN",
        "RET=RSI_ACTIVATE(\"cellcal_rsi\")", "IF RET<>RSIOK THEN", "RET=RSI_PROCESS_ON(#ABSOLUTE)",
        "IF RET<>RSIOK THEN", "RSI_MOVECORR()", "RET=RSI_PROCESS_OFF()", "IF RET<>RSIOK THEN",
        "PTP $AXIS_ACT_MEAS"})
    at = line_of(main, line, at) + 1;
  EXPECT_NE(
      source.find("RET=RSI_SetParameter(\"cellcal_rsi\",\"AxisCorr_1\",\"LowerLimA1\",LIMIT)"),
      std::string::npos);
  for (const char* old : {"RSI_CREATE", "RSI_ON(", "RSI_OFF", "RSI_DELETE", "RSI_RESET",
                          "RSI_SetPublicPar", "CONTID", "#IPO_FAST"})
    EXPECT_EQ(source.find(old), std::string::npos) << old;
}

TEST(RsiFiles, OfRsi6FixTheMonitorAndNameTheSignals) {
  for (const int version : {4, 6}) {
    for (const bool space : {false, true}) {
      RsiFilesConfig config = some_pc(version);
      config.space.on = space;
      const std::string text = rsi_files(config).at("cellcal_rsi.rsix");
      const auto count = [&](const std::string& part) {
        std::size_t n = 0;
        for (std::size_t at = text.find(part); at != std::string::npos;
             at = text.find(part, at + 1))
          ++n;
        return n;
      };
      // ConfigFile's, RefCorrSys', and in RSI 6 twelve of AxisCorrMon and two of PosCorrMon.
      EXPECT_EQ(count("IsRuntime=\"false\""),
                1u + (space ? 1 : 0) + (version == 6 ? 12 + (space ? 2 : 0) : 0));
      EXPECT_EQ(count("SignalName=\"Ethernet_1|Out"), version == 6 ? 7u : 0u);
      EXPECT_EQ(count("SignalName=\"Status_1|Stat\""), version == 6 ? 1u : 0u);
      EXPECT_EQ(count("IsPublic=\"true\""), space ? 0u : 12u);
    }
  }
}

TEST(RsiFiles, DeleteContextsThatWereLeftBeforeTheyMakeTheirs) {
  const std::vector<std::string> main =
      body(rsi_files(some_pc(4)).at("cellcal_rsi.src"), "DEF CELLCAL_RSI");
  EXPECT_LT(line_of(main, "RET=RSI_RESET()"), line_of(main, "RET=RSI_CREATE("));
}

/// A1 from -155 to 120 deg, the others unrestricted.
RsiFilesConfig with_ranges(int version) {
  RsiFilesConfig config = some_pc(version);
  config.ranges_deg.assign(6, {});
  config.ranges_deg[0] = {-155.0, 120.0};
  return config;
}

TEST(RsiFiles, FenceEachAxisByItsSwitchesAndItsRangeFromWhereTheArmStands) {
  for (const int version : {3, 4, 6}) {
    const bool six = version == 6;
    const std::string source = rsi_files(with_ranges(version)).at("cellcal_rsi.src");
    const std::vector<std::string> main = body(source, "DEF CELLCAL_RSI");
    const std::size_t call = line_of(main, "IF CC_FENCE(");
    EXPECT_LT(line_of(main, six ? "RET=RSI_LOAD(" : "RET=RSI_CREATE("), call);
    EXPECT_LT(call, line_of(main, six ? "RET=RSI_ACTIVATE(" : "RET=RSI_ON("));
    const std::vector<std::string> fence = body(source, "DEFFCT BOOL CC_FENCE");
    const std::string object = version == 3 ? "AXISCORR1" : "AxisCorr_1";
    for (const auto& [value, parameter] :
         {std::pair{"CC_LOW($SOFTN_END[1],-155.1,$AXIS_ACT_MEAS.A1)", "LowerLimA1"},
          std::pair{"CC_HIGH($SOFTP_END[1],120.1,$AXIS_ACT_MEAS.A1)", "UpperLimA1"},
          std::pair{"CC_HIGH($SOFTP_END[6],360.1,$AXIS_ACT_MEAS.A6)", "UpperLimA6"}}) {
      const std::size_t set = line_of(fence, std::string("LIMIT=") + value);
      EXPECT_EQ(fence.at(set + 1), (six ? "RET=RSI_SetParameter(\"cellcal_rsi\",\""
                                        : "RET=RSI_SetPublicPar(CONTID,\"") +
                                       object + "\",\"" + parameter + "\",LIMIT)");
    }
    EXPECT_EQ(line_of(body(source, "DEFFCT REAL CC_LOW"), "LIMIT=-45.5"), 5U);
    EXPECT_NO_THROW(sim::RsiProgram{source});
    for (const std::string& complaint : check_krl(source)) ADD_FAILURE() << complaint;
  }
  RsiFilesConfig space = some_pc(4);
  space.space.on = true;
  EXPECT_EQ(rsi_files(space).at("cellcal_rsi.src").find("CC_"), std::string::npos);
}

TEST(RsiFiles, HoldOnTheAxesAndNotOnTheStop) {
  const std::string text = rsi_files(some_pc(4)).at("cellcal_rsi_ethernet.xml");
  pugi::xml_document document;
  ASSERT_TRUE(document.load_buffer(text.data(), text.size()));
  int axes = 0;
  for (const pugi::xml_node& element :
       document.select_node("/ROOT/RECEIVE/ELEMENTS").node().children("ELEMENT")) {
    const std::string tag = element.attribute("TAG").value();
    const bool stop = tag == "Stop";
    EXPECT_EQ(element.attribute("HOLDON").value(), std::string(stop ? "0" : "1")) << tag;
    EXPECT_EQ(element.attribute("INDX").as_int(), stop ? 7 : ++axes) << tag;
    EXPECT_EQ(tag, stop ? "Stop" : "AK.A" + std::to_string(axes));
  }
  EXPECT_EQ(axes, 6);
  std::set<std::string> sent;
  for (const auto& one : document.select_nodes("/ROOT/SEND/ELEMENTS/ELEMENT/@TAG")) {
    sent.insert(one.attribute().value());
  }
  for (const char* needed : {"DEF_AIPos", "DEF_ASPos", "DEF_Delay"}) {
    EXPECT_EQ(sent.count(needed), 1u) << needed;
  }
}

/// Object, parameter or input by its name: its number, as the two releases count.
std::map<std::string, std::string> context_of(int version) {
  const ControllerFiles files = rsi_files(some_pc(version));
  const std::string& text = files.at(version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix");
  pugi::xml_document document;
  EXPECT_TRUE(document.load_buffer(text.data(), text.size()));
  std::map<std::string, std::string> found;
  const char* object = version == 3 ? "RSIObject" : "RsiObject";
  const char* number = version == 3 ? "ParamID" : "ParamId";
  const pugi::xml_node root =
      version == 3 ? document.document_element() : document.document_element().child("RsiObjects");
  for (const pugi::xml_node& one : root.children(object)) {
    std::string name = one.attribute("ObjType").value();
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    for (const pugi::xml_node& parameter : one.child("Parameters").children("Parameter")) {
      found[name + "." + parameter.attribute("Name").value()] =
          std::string(parameter.attribute(number).value()) + "=" +
          parameter.attribute("ParamValue").value();
    }
    for (const pugi::xml_node& input : one.child("Inputs").children("Input")) {
      found[name + ".in" + input.attribute("InIdx").value()] = input.attribute("OutIdx").value();
    }
  }
  return found;
}

TEST(RsiFiles, NumberObjectsAsTheirReleaseDoes) {
  auto three = context_of(3), four = context_of(4);
  EXPECT_EQ(three["AXISCORR.LowerLimA1"], "1=-45.5");
  EXPECT_EQ(three["AXISCORR.UpperLimA1"], "13=45.5");
  EXPECT_EQ(four["AXISCORR.LowerLimA1"], "0=-45.5");
  EXPECT_EQ(four["AXISCORR.UpperLimA6"], "11=45.5");
  EXPECT_EQ(three["AXISCORRMON.MaxA6"], "6=45.5");
  EXPECT_EQ(four["AXISCORRMON.MaxA6"], "5=45.5");
  EXPECT_EQ(three["AXISCORR.in6"], "6");
  EXPECT_EQ(four["AXISCORR.in5"], "5");
  EXPECT_EQ(three["STOP.in1"], "7");
  EXPECT_EQ(four["STOP.in0"], "6");
  EXPECT_EQ(three["STOP.Mode"], "1=4");
  EXPECT_EQ(three.count("STOP.Channel"), 0u) << "it makes RSI 3 ignore all corrections";
  EXPECT_EQ(three["ETHERNET.Precision"], "8=5");
  EXPECT_EQ(four["ETHERNET.Precision"], "7=5");
}

TEST(RsiFiles, AreRefusedByTheKeyThatIsWrong) {
  const std::pair<const char*, std::function<void(RsiFilesConfig&)>> cases[] = {
      {"pc_address", [](RsiFilesConfig& c) { c.pc_address = "0.0.0.0"; }},
      {"pc_address", [](RsiFilesConfig& c) { c.pc_address = ""; }},
      {"pc_address", [](RsiFilesConfig& c) { c.pc_address = "pc.local"; }},
      {"192.168.0.x", [](RsiFilesConfig& c) { c.pc_address = "192.168.0.7"; }},
      {"172.16.x.x", [](RsiFilesConfig& c) { c.pc_address = "172.16.3.7"; }},
      {"172.17.x.x", [](RsiFilesConfig& c) { c.pc_address = "172.17.0.1"; }},
      {"[controller]", [](RsiFilesConfig& c) { c.pc_address = "0.0.0.0"; }},
      {"rsi_version", [](RsiFilesConfig& c) { c.rsi_version = 2; }},
      {"5 (KSS 8.7) or 6 (iiQKA.OS2)", [](RsiFilesConfig& c) { c.rsi_version = 7; }},
      {"sentype", [](RsiFilesConfig& c) { c.sentype = "<a>"; }},
      {"stop_tag", [](RsiFilesConfig& c) { c.stop_tag = ""; }},
      {"correction_limit_deg", [](RsiFilesConfig& c) { c.correction_limit_deg = 0.0; }},
  };
  for (const auto& [key, spoil] : cases) {
    RsiFilesConfig config = some_pc(4);
    spoil(config);
    try {
      rsi_files(config);
      ADD_FAILURE() << key << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace cellcal::drivers
