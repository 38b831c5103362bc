// Sets of controller files, valid and invalid.

#include "drivers/kuka/krl/krl_verify.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "tests/drivers/kuka/krl/krl_verdict.h"

namespace cellcal::drivers {
namespace {

TEST(RsiSet, FitsAsItWasMade) {
  for (const int version : {3, 4, 5, 6}) {
    EXPECT_EQ(verdict(rsi_files(rsi_config(version)), rsi_config(version)), "") << version;
  }
}

TEST(RsiSet, OfRsi3IsReadAlikeFromContextAndModel) {
  const ControllerFiles files = rsi_files(rsi_config(3));
  ASSERT_EQ(files.size(), 5u);
  const RsiContextFile context = read_rsi_context(files.at("cellcal_rsi.rsi.xml"), "context");
  const RsiContextFile model = read_rsi_model(files.at("cellcal_rsi.rsi"), "model");
  expect_alike(context, model);
  EXPECT_EQ(kind_of(files.at("cellcal_rsi.rsi.diagram"), "cellcal_rsi.rsi.diagram"),
            ControllerFileKind::kRsiDiagram);
}

TEST(RsiSet, TellsModeAndOverrideOverChannelsOfTheEthernetObject) {
  for (const int version : {3, 4, 6}) {
    const ControllerFiles files = rsi_files(rsi_config(version));
    const RsiChannelFile channel =
        read_rsi_channel(files.at("cellcal_rsi_ethernet.xml"), "ethernet");
    ASSERT_EQ(channel.send.size(), 6u);
    EXPECT_EQ(channel.send[4].tag + channel.send[4].type, "Mode.RLONG");
    EXPECT_EQ(channel.send[5].tag + channel.send[5].type, "OvPro.RDOUBLE");
    const RsiContextFile context = read_rsi_context(
        files.at(version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix"), "context");
    for (std::size_t i = 4; i < 6; ++i) {
      const RsiInput* input = context.only("ETHERNET")->input(channel.send[i].index);
      ASSERT_NE(input, nullptr);
      EXPECT_EQ(input->from, context.only(i == 4 ? "STATUS" : "OV_PRO")->id);
      EXPECT_EQ(input->from_index, 1);
    }
    EXPECT_EQ(context.only("STATUS")->parameter("Type")->value, "5") << "Mode_Op";
  }
}

TEST(RsiSet, WithoutModeAndOverrideGoesOnWorkingWithAWarning) {
  for (const int version : {3, 4, 6}) {
    RsiFilesConfig older = rsi_config(version);
    older.mode_tag.clear();
    older.override_tag.clear();
    const ControllerFiles files = rsi_files(older);
    for (const auto& [name, text] : files) {
      EXPECT_EQ(text.find("STATUS1"), std::string::npos) << name;
      EXPECT_EQ(text.find("OV_PRO"), std::string::npos) << name;
    }
    EXPECT_EQ(verdict(files, older), "") << "neither is asked for";
    const std::string said = verdict(files, rsi_config(version));
    EXPECT_EQ(said.find("refused"), std::string::npos) << said;
    EXPECT_NE(said.find("SEND: Mode.R is missing: the operating mode stays unknown"),
              std::string::npos)
        << said;
    EXPECT_NE(said.find("SEND: OvPro.R is missing: the override stays unknown"), std::string::npos)
        << said;
    EXPECT_EQ(verdict(rsi_files(rsi_config(version)), older), "") << "more than is read";
  }
}

TEST(RsiSet, MayTellOneOfThemAlone) {
  for (const int version : {3, 4, 6}) {
    RsiFilesConfig config = rsi_config(version);
    config.mode_tag.clear();
    config.override_tag = "Speed";
    EXPECT_EQ(verdict(rsi_files(config), config), "") << version;
  }
}

TEST(RsiSet, SendsTheContactInputWhereItIsConfigured) {
  for (const int version : {3, 4}) {
    RsiFilesConfig config = rsi_config(version);
    EXPECT_EQ(rsi_files(config).at("cellcal_rsi_ethernet.xml").find("Contact"), std::string::npos);
    config.contact_tag = "Contact.R";
    config.input = 17;
    const ControllerFiles files = rsi_files(config);
    EXPECT_EQ(verdict(files, config), "");
    const RsiChannelFile channel =
        read_rsi_channel(files.at("cellcal_rsi_ethernet.xml"), "ethernet");
    EXPECT_EQ(channel.send.back().tag + channel.send.back().type, "Contact.RBOOL");
    const RsiContextFile context = read_rsi_context(
        files.at(version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix"), "context");
    const RsiInput* input = context.only("ETHERNET")->input(channel.send.back().index);
    ASSERT_NE(input, nullptr);
    EXPECT_EQ(input->from, context.only("DIGIN")->id);
    EXPECT_EQ(context.only("DIGIN")->parameter("Index")->value, "17");

    const auto with = [&](const std::string& from, const std::string& to) {
      ControllerFiles spoiled = files;
      std::string& text = spoiled.at(version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix");
      EXPECT_NE(text.find(from), std::string::npos) << from;
      text.replace(text.find(from), from.size(), to);
      return verdict(spoiled, config);
    };
    const auto has = [](const std::string& said, const char* words) {
      return said.find(words) != std::string::npos;
    };
    EXPECT_TRUE(has(with("ParamValue=\"17\"", "ParamValue=\"18\""),
                    "is 18. Set 17: Contact.R is "
                    "the contact input"));
    const std::string id = version == 3 ? "ParamID=\"1\"" : "ParamId=\"0\"";
    const std::string wide = "<Parameter Name=\"DataSize\" " +
                             std::string(version == 3 ? "ParamID=\"2\"" : "ParamId=\"1\"") +
                             " ParamValue=\"1\"/>";
    const std::string index = "<Parameter Name=\"Index\" " + id + " ParamValue=\"17\"/>";
    EXPECT_TRUE(has(with(index, index + wide), "DataSize of"));
    const std::string older = verdict(rsi_files(rsi_config(version)), config);
    EXPECT_TRUE(has(older, "Contact.R is missing: the contact input stays unknown")) << older;
    EXPECT_FALSE(has(older, "refused")) << older;
  }
}

TEST(RsiSet, IsCountedFromOneInBothReleases) {
  const RsiContextFile three =
      read_rsi_context(rsi_files(rsi_config(3)).at("cellcal_rsi.rsi.xml"), "3");
  const RsiContextFile four =
      read_rsi_context(rsi_files(rsi_config(4)).at("cellcal_rsi.rsix"), "4");
  const RsiContextFile six = read_rsi_context(rsi_files(rsi_config(6)).at("cellcal_rsi.rsix"), "6");
  EXPECT_EQ(three.rsi_version, 3);
  EXPECT_EQ(four.rsi_version, 4);
  EXPECT_EQ(six.rsi_version, 6);
  for (const RsiContextFile* file : {&three, &four, &six}) {
    EXPECT_EQ(file->only("AXISCORR")->input(6)->from_index, 6);
    EXPECT_EQ(file->only("STOP")->input(1)->from_index, 7);
  }
}

TEST(RsiSet, IsRefusedByFileLineAndWords) {
  constexpr const char* kChannel = "cellcal_rsi_ethernet.xml";
  constexpr const char* kFour = "cellcal_rsi.rsix";
  constexpr const char* kThree = "cellcal_rsi.rsi.xml";
  const Spoiled cases[] = {
      {kChannel, "INDX=\"3\" HOLDON=\"1\"", "INDX=\"3\" HOLDON=\"0\"",
       ":25: AK.A3 has HOLDON=\"0\" with RSI_ON(#ABSOLUTE): one late reply moves"},
      {kChannel, "<IP_NUMBER>10.0.0.5", "<IP_NUMBER>10.0.0.6", "IP_NUMBER is 10.0.0.6"},
      {kChannel, "<PORT>49152", "<PORT>49153", "PORT is 49153, [rsi] port is 49152"},
      {kChannel, "<SENTYPE>ImFree", "<SENTYPE>imfree", ":8: SENTYPE is \"imfree\""},
      {kChannel, "<ONLYSEND>FALSE", "<ONLYSEND>TRUE", "ONLYSEND is TRUE"},
      {kChannel, "DEF_ASPos", "DEF_RSol", "SEND: DEF_ASPos is missing"},
      {kChannel, "DEF_Delay", "DEF_Tech", "SEND: DEF_Delay is missing"},
      {kChannel, "DEF_AIPos", "DEF_MACur", "SEND: DEF_AIPos is missing"},
      {kChannel, "AK.A4", "AKorr.A4", "RECEIVE: AK.A4 is missing"},
      {kChannel, "TAG=\"Stop\"", "TAG=\"MoveStop\"", "RECEIVE: Stop is missing"},
      {kChannel, "INDX=\"7\" HOLDON=\"0\"", "INDX=\"7\" HOLDON=\"1\"", "Stop must have TYPE"},
      {kChannel, "INDX=\"2\" HOLDON", "INDX=\"12\" HOLDON",
       "input 2 comes from Ethernet_1 output 2"},
      {kFour, "OutIdx=\"3\"", "OutIdx=\"4\"", "input 4 comes from Ethernet_1 output 5"},
      {kThree, "OutIdx=\"4\"", "OutIdx=\"5\"", "input 4 comes from ETHERNET1 output 5", 3},
      {kFour, "Name=\"Precision\" ParamId=\"7\" ParamValue=\"5\"",
       "Name=\"Precision\" ParamId=\"7\" ParamValue=\"3\"", "Precision is 3"},
      {kThree, "<Parameter Name=\"Precision\" ParamID=\"8\" ParamValue=\"5\"/>", "",
       "Precision is 1", 3},
      {kFour, "ParamValue=\"-90.0\"", "ParamValue=\"-5.0\"", "LowerLimA1 of AxisCorr_1 is -5 deg"},
      {kFour, "Name=\"UpperLimA6\" ParamId=\"11\" ParamValue=\"90.0\"",
       "Name=\"UpperLimA6\" ParamId=\"11\" ParamValue=\"89.9\"",
       "UpperLimA6 of AxisCorr_1 is 89.9"},
      {kThree, "Name=\"MaxA2\" ParamID=\"2\" ParamValue=\"90.0\"",
       "Name=\"MaxA2\" ParamID=\"2\" ParamValue=\"6\"", "KSS29000", 3},
      {kThree, "AXISCORRMON\" ObjTypeID=\"82\"", "AXISMON\" ObjTypeID=\"82\"",
       "AXISCORRMON is missing", 3},
      {kFour, "Name=\"Mode\" ParamId=\"0\" ParamValue=\"4\"",
       "Name=\"Mode\" ParamId=\"0\" ParamValue=\"1\"", "ExitMoveCorr"},
      {kFour, "ObjType=\"AxisCorr\"", "ObjType=\"AXISCORR\"", "is spelled \"AxisCorr\" in RSI 4"},
      {kFour, "OutObjId=\"Status_1\"", "OutObjId=\"OV_PRO_1\"",
       "input 1 is Mode.R (INDX in line 17), so it must come from the output of a Status object"},
      {kThree, "OutObjID=\"OV_PRO1\"", "OutObjID=\"STATUS1\"", "output of a OV_PRO object", 3},
      {kFour, "Name=\"Type\" ParamId=\"0\" ParamValue=\"5\"",
       "Name=\"Type\" ParamId=\"0\" ParamValue=\"2\"",
       "Type of Status_1 is 2. Set 5 (Mode_Op): Mode.R is the operating mode"},
      {kThree, "<Parameter Name=\"Type\" ParamID=\"1\" ParamValue=\"5\"/>", "",
       "Type of STATUS1 is 0", 3},
      {kFour, "ObjType=\"Status\"", "ObjType=\"STATUS\"", "is spelled \"Status\" in RSI 4"},
      {kChannel, "TYPE=\"LONG\" INDX=\"1\"", "TYPE=\"LONG\" INDX=\"9\"", "input 9 is Mode.R"},
      {kFour, "cellcal_rsi_ethernet.xml", "other.xml", "ConfigFile is \"other.xml\""},
      {kFour, "ObjType=\"AxisCorrMon\"", "ObjType=\"PosCorr\"", "corrects in addition to AXISCORR"},
      {"cellcal_rsi.src", "#ABSOLUTE", "#RELATIVE", "RSI_ON does not contain #ABSOLUTE"},
      {"cellcal_rsi.src", "    LOOP\r\n      HALT\r\n    ENDLOOP", "    HALT",
       ":30: HALT after a failed call of RSI"},
      {"cellcal_rsi.src", "RSI_CREATE(\"cellcal_rsi\"", "RSI_CREATE(\"cellcal_rsi.rsi\"",
       "RSI_CREATE names the extension"},
      {"cellcal_rsi.src", "RSI_CREATE(\"cellcal_rsi.rsi\"", "RSI_CREATE(\"cellcal_rsi\"",
       "RSI_CREATE lacks the extension", 3},
      {"cellcal_rsi.src", "#ABSOLUTE", "#RELATIVE", "RSI_PROCESS_ON does not contain #ABSOLUTE", 6},
      {"cellcal_rsi.src", "RSI_LOAD(\"cellcal_rsi\"", "RSI_LOAD(\"cellcal_rsi.rsi\"",
       "RSI_LOAD names the extension", 6},
      {"cellcal_rsi.src", "RSI_PROCESS_ON(", "RSI_ON(",
       "RSI_ON is a call of RSI 3 to 5, [controller] rsi_version is 6", 6},
      {"cellcal_rsi.src", "RSI_ON(#ABSOLUTE,#IPO_FAST)", "RSI_PROCESS_ON(#ABSOLUTE)",
       "RSI_PROCESS_ON is a call of RSI 6, [controller] rsi_version is 4"},
      {kFour, "IsPublic=\"true\" Name=\"UpperLimA2\"", "Name=\"UpperLimA2\"",
       "UpperLimA2 of AxisCorr_1 lacks IsPublic=\"true\": cellcal_rsi.src cannot set it and halts",
       6},
      {kThree, "IsPublic=\"true\" Name=\"LowerLimA1\"", "Name=\"LowerLimA1\"",
       "LowerLimA1 of AXISCORR1 lacks IsPublic=\"true\"", 3},
      {kFour, "IsRuntime=\"false\" Name=\"MaxA1\"", "Name=\"MaxA1\"",
       "is a context of RSI 4, [controller] rsi_version is 6", 6},
      {kFour, "Name=\"MaxA1\"", "IsRuntime=\"false\" Name=\"MaxA1\"",
       "is a context of RSI 6, [controller] rsi_version is 5", 5},
      {kFour, "OutObjId=\"Ethernet_1\" OutIdx=\"6\"", "OutObjId=\"Ethernet_1\" OutIdx=\"5\"",
       "input 1 comes from Ethernet_1 output 6", 6},
  };
  expect_refused(cases, rsi_config);
}

TEST(RsiSet, HasTheFenceOfTheCell) {
  RsiFilesConfig config = rsi_config();
  const ControllerFiles without_cell = rsi_files(config);
  config.ranges_deg.assign(6, {-170.0, 170.0});
  EXPECT_EQ(verdict(rsi_files(config), config), "");
  EXPECT_EQ(verdict(rsi_files(config), rsi_config()), "") << "the ranges are not known";
  EXPECT_EQ(verdict(without_cell, config).rfind("warned cellcal_rsi.src:", 0), 0U);
  ControllerFiles other = rsi_files(config);
  replace(other, "cellcal_rsi.src", "170.1,$AXIS_ACT_MEAS.A3", "90.1,$AXIS_ACT_MEAS.A3");
  EXPECT_NE(verdict(other, config).find("LowerLimA3 is not LIMIT=CC_LOW($SOFTN_END[3],-170.1"),
            std::string::npos)
      << verdict(other, config);
  config.correction_limit_deg = 120.0;
  EXPECT_NE(verdict(other, config).find("the fence is 90 deg, [rsi] correction_limit_deg is 120"),
            std::string::npos);
  config.correction_limit_deg = 90.0;
  ControllerFiles none = rsi_files(config);
  std::string& program = none.at("cellcal_rsi.src");
  for (std::size_t at = program.find("RSI_SetPublicPar"); at != std::string::npos;
       at = program.find("RSI_SetPublicPar"))
    program.replace(at, 3, "NOT");
  EXPECT_NE(verdict(none, config)
                .find("no call sets AXISCORR's limits: the correction is limited by "
                      "correction_limit_deg = 90 on both sides"),
            std::string::npos)
      << verdict(none, config);
}

TEST(RsiSet, OfTheOtherModeNeedsTheOtherHold) {
  const std::string said =
      verdict(rsi_files(rsi_config()), rsi_config(), CorrectionMode::kRelative);
  EXPECT_NE(said.find("AK.A1 has HOLDON=\"1\" with RSI_ON(#RELATIVE): every late reply repeats"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("RSI_ON does not contain #RELATIVE"), std::string::npos) << said;
}

TEST(RsiSet, OfTheOtherReleaseIsRefused) {
  const std::string said = verdict(rsi_files(rsi_config(3)), rsi_config(4));
  EXPECT_NE(said.find("is a context of RSI 3, [controller] rsi_version is 4"), std::string::npos)
      << said;
  const std::string of_six = verdict(rsi_files(rsi_config(6)), rsi_config(5));
  for (const char* words : {"is a context of RSI 6", "RSI_LOAD is a call of RSI 6",
                            "RSI_PROCESS_ON is a call of RSI 6", "RSI_SETPARAMETER is a call"})
    EXPECT_NE(of_six.find(words), std::string::npos) << words << "\nsaid: " << of_six;
  RsiFilesConfig wide = rsi_config(6), deployed = rsi_config(4);
  deployed.space.on = wide.space.on = true;
  EXPECT_NE(verdict(rsi_files(deployed), wide).find("is a context of RSI 4"), std::string::npos);
}

TEST(RsiSet, WithLimitsBelowTheConfigurationsIsRefusedAndAboveIsFine) {
  RsiFilesConfig narrow = rsi_config(), wide = rsi_config();
  narrow.correction_limit_deg = 12.25;
  wide.correction_limit_deg = 45.0;
  EXPECT_EQ(verdict(rsi_files(wide), narrow), "");
  EXPECT_NE(verdict(rsi_files(narrow), wide).find("silently clamped"), std::string::npos);
}

TEST(RsiSet, LacksItsParts) {
  for (const int version : {3, 4, 6}) {
    const ControllerFiles whole = rsi_files(rsi_config(version));
    for (const auto& [name, text] : whole) {
      ControllerFiles files = whole;
      files.erase(name);
      EXPECT_NE(verdict(files, rsi_config(version)), "") << name;
    }
  }
  EXPECT_NE(verdict({}, rsi_config()), "");
}

TEST(RsiSet, WithoutAStatedAddressSaysThatItWasNotCompared) {
  RsiFilesConfig any = rsi_config();
  any.pc_address = "0.0.0.0";
  const std::string said = verdict(rsi_files(rsi_config()), any);
  EXPECT_EQ(said.rfind("warned", 0), 0u) << said;
  EXPECT_NE(said.find("IP_NUMBER 10.0.0.5 not compared"), std::string::npos) << said;
}

TEST(RsiModel, ThatWasDrawnOtherwiseIsAWarning) {
  ControllerFiles files = rsi_files(rsi_config(3));
  replace(files, "cellcal_rsi.rsi", "name=\"LowerLimA1\" value=\"-90.0\"",
          "name=\"LowerLimA1\" value=\"-5.0\"");
  replace(files, "cellcal_rsi.rsi", "ETHERNET1/Out2", "ETHERNET1/Out3");
  const std::string said = verdict(files, rsi_config(3));
  EXPECT_EQ(said.rfind("warned", 0), 0u) << said;
  EXPECT_NE(said.find("LowerLimA1 of AXISCORR1 is -5"), std::string::npos) << said;
  EXPECT_NE(said.find("input 2 is connected differently"), std::string::npos) << said;
}

TEST(RsiModel, WithPortsThatWereRenamedIsAWarning) {
  ControllerFiles files = rsi_files(rsi_config(3));
  replace(files, "cellcal_rsi.rsi", "ETHERNET1/Out2", "ETHERNET1/AK_A2");
  const std::string said = verdict(files, rsi_config(3));
  EXPECT_EQ(said.rfind("warned", 0), 0u) << said;
  EXPECT_NE(said.find("input 2 comes from an output with another name"), std::string::npos) << said;
}

TEST(RsiSet, WithAStopChannelOnRsi3IsAWarning) {
  ControllerFiles files = rsi_files(rsi_config(3));
  replace(files, "cellcal_rsi.rsi.xml", "ParamID=\"1\" ParamValue=\"4\"/>",
          "ParamID=\"1\" ParamValue=\"4\"/><Parameter Name=\"Channel\" ParamID=\"2\" "
          "ParamValue=\"0\"/>");
  const std::string said = verdict(files, rsi_config(3));
  EXPECT_EQ(said.rfind("warned", 0), 0u) << said;
  EXPECT_NE(said.find("has a Channel"), std::string::npos) << said;
}

TEST(RsiDiagram, DrawsEveryObjectAndConnectsWhatTheModelConnects) {
  const ControllerFiles files = rsi_files(rsi_config(3));
  const std::string& diagram = files.at("cellcal_rsi.rsi.diagram");
  const RsiContextFile model = read_rsi_model(files.at("cellcal_rsi.rsi"), "model");
  std::size_t wires = 0;
  for (const RsiObject& one : model.objects) {
    EXPECT_NE(diagram.find("<rSIElementMoniker name=\"//" + one.id + "\""), std::string::npos);
    wires += one.inputs.size();
  }
  std::size_t drawn = 0;
  for (std::size_t at = 0; (at = diagram.find("<rSISignalConnector ", at)) != std::string::npos;
       ++at) {
    ++drawn;
  }
  EXPECT_EQ(drawn, wires);
}

TEST(EkiSet, FitsAsItWasMade) {
  EkiFilesConfig config;
  config.external_axes = 2;
  EXPECT_EQ(all(verify_eki_files(eki_files(config), config)), "");
}

TEST(EkiSet, IsRefusedByFileLineAndWords) {
  const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
      {{"<PORT>54600", "<PORT>54601"}, "PORT is 54601, [eki] port is 54600"},
      {{"<IP>172.31.1.147", "<IP>172.31.1.148"}, "IP is \"172.31.1.148\""},
      {{"<TYPE>Client", "<TYPE>Server"}, "EXTERNAL/TYPE"},
      {{"<PROTOCOL>TCP", "<PROTOCOL>UDP"}, "PROTOCOL is \"UDP\""},
      {{"Mode=\"FIFO\"", "Mode=\"LIFO\""}, "read in order"},
      {{"Limit=\"16\"", "Limit=\"2\""}, "BUFFERING Limit is 2"},
      {{"Limit=\"16384\"", "Limit=\"50\""}, "BUFFSIZE Limit is 50. Set at least 16384"},
      {{"<ENVIRONMENT>Submit", "<ENVIRONMENT>Program"}, "ENVIRONMENT"},
      {{"Set_Flag=\"901\"", "Set_Flag=\"1\""}, "ALIVE Set_Flag is 1"},
      {{"RobotCommand/@Seq", "RobotCommand/@Count"}, "the element RobotCommand/@Seq is missing"},
      {{"@Duration\" Type=\"REAL\"", "@Duration\" Type=\"INT\""}, "Set \"REAL\""},
      {{"RobotState/Latch/@A5", "RobotState/Latch/@A9"}, "SEND: the element RobotState/Latch/@A5"},
  };
  for (const auto& [change, words] : cases) {
    ControllerFiles files = eki_files({});
    replace(files, "CellcalEki.xml", change.first, change.second);
    const std::string said = all(verify_eki_files(files, {}));
    EXPECT_NE(said.find(words), std::string::npos) << words << "\nsaid: " << said;
    EXPECT_EQ(said.rfind("refused", 0), 0u) << words << "\nsaid: " << said;
  }
}

TEST(EkiSet, WithAnotherInputInItsProgramIsRefusedByTheLine) {
  EkiFilesConfig other;
  other.input = 17;
  const std::string said = all(verify_eki_files(eki_files({}), other));
  EXPECT_EQ(said.rfind("refused cellcal_eki.src:", 0), 0u) << said;
  EXPECT_NE(said.find("$IN[17]"), std::string::npos) << said;
}

TEST(EkiSet, MustBeCalledLikeItsChannel) {
  ControllerFiles files = eki_files({});
  files["Other.xml"] = files.at("CellcalEki.xml");
  files.erase("CellcalEki.xml");
  EXPECT_NE(all(verify_eki_files(files, {})).find("Other.xml: must be called CellcalEki.xml"),
            std::string::npos);
}

TEST(ControllerXml, ThatCannotBeReadIsNamedWithItsLineAndElement) {
  const std::string sound = rsi_files(rsi_config()).at("cellcal_rsi_ethernet.xml");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string twice =
      "<CONFIG><IP_NUMBER>1.2.3.4</IP_NUMBER><IP_NUMBER>1.2.3.5</IP_NUMBER><SENTYPE>a</SENTYPE>"
      "</CONFIG>";
  const std::pair<std::string, const char*> cases[] = {
      {sound.substr(0, sound.size() / 2), "not well-formed XML"},
      {"", "not well-formed XML"},
      {"<?xml version=\"1.0\"?>", "not well-formed XML"},
      {std::string("\xFF\xFE<\0R\0", 6), "not UTF-8 text"},
      {std::string(kMostFile + 1, ' '), "bytes, a controller's file has at most"},
      {with("<PORT>49152", "<PORT>x"), ":7: <PORT>: PORT = \"x\" is not an integer"},
      {with("<PORT>49152", "<PORT>70000"), "PORT = \"70000\""},
      {with("<PORT>49152</PORT>", ""), "<CONFIG>: <PORT> is missing"},
      {with("INDX=\"3\"", "INDX=\"65\""), "INDX of AK.A3 = \"65\""},
      {with("INDX=\"3\"", "INDX=\"2\""), "INDX 2 is already used by AK.A2"},
      {with("AK.A3", "AK.A2"), "AK.A2 is already in line 24"},
      {with("INDX=\"1\" HOLDON=\"1\"", "INDX=\"1\""), "HOLDON of AK.A1 is missing"},
      {with("INDX=\"1\" HOLDON=\"1\"", "INDX=\"1\" HOLDON=\"2\""), "HOLDON is neither"},
      {with("<ROOT>", "<root>").replace(with("<ROOT>", "<root>").rfind("</ROOT>"), 7, "</root>"),
       "is not ROOT"},
      {"<ROOT>" + twice + "</ROOT>", "occurs twice"},
  };
  for (const auto& [text, words] : cases) {
    try {
      read_rsi_channel(text, "x.xml");
      ADD_FAILURE() << "accepted; expected " << words;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).rfind("x.xml", 0), 0u) << error.what();
    }
  }
}

TEST(ControllerXml, IsReadWithAByteOrderMarkAndWindowsLines) {
  const std::string sound = rsi_files(rsi_config()).at("cellcal_rsi_ethernet.xml");
  const RsiChannelFile file = read_rsi_channel("\xEF\xBB\xBF" + sound, "x.xml");
  EXPECT_EQ(file.port.value, 49152);
  EXPECT_EQ(file.port.line, 7);
  EXPECT_EQ(file.receive.size(), 7u);
}

TEST(ControllerFolder, IsReadByItsEndingsAndRefusedByName) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("krl-verify-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const auto& [name, text] : rsi_files(rsi_config())) std::ofstream(folder / name) << text;
  std::ofstream(folder / "notes.txt") << "not a controller's";
  const ControllerFiles files = read_controller_folder(folder);
  EXPECT_EQ(files.size(), 3u);
  std::filesystem::resize_file(folder / "cellcal_rsi.src", kMostFile + 1);
  try {
    read_controller_folder(folder);
    ADD_FAILURE() << "a huge file was read";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("cellcal_rsi.src"), std::string::npos);
  }
  std::filesystem::remove_all(folder);
  EXPECT_THROW(read_controller_folder(folder), ConfigError);
}

/// A backup has KUKA's own files, too, and cellcal's in several folders.
TEST(ControllerFolder, OfABackupHasItsFilesInFoldersBelow) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("krl-backup-" + std::to_string(::getpid()));
  const auto put = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  };
  const ControllerFiles made = rsi_files(rsi_config());
  for (const auto& [name, text] : made)
    put((name.ends_with(".src") ? "KRC/R1/Program/" : "C/KRC/Config/SensorInterface/") + name,
        text);
  put("KRC/R1/cell.src", "DEF CELL()\nEND\n");
  put("C/KRC/Config/other.xml", "<A>");
  put("RDC/robot.xml", "<A>");
  put("backup.xml", "<A>");
  put("KRC/R1/Program/A/cellcal_fix.src", "DEF CELLCAL_FIX()\nEND\n");
  put("KRC/R1/Program/B/cellcal_fix.src", "DEF CELLCAL_FIX( )\nEND\n");
  EXPECT_EQ(read_controller_folder(folder), made);
  put("KRC/R1/Program/Old/CELLCAL_RSI.SRC", made.at("cellcal_rsi.src"));
  EXPECT_EQ(read_controller_folder(folder).size(), made.size() + 1) << "names as on the disk";
  put("KRC/R1/Program/Old/cellcal_rsi.src", "DEF OTHER()\nEND\n");
  EXPECT_THROW(read_controller_folder(folder), ConfigError);
  put("cellcal_rsi.src", "DEF OTHER()\nEND\n");
  EXPECT_EQ(read_controller_folder(folder).size(), 2U) << "a folder with a generated file is alone";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace cellcal::drivers
