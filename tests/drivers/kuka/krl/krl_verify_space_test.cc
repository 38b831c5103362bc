// Sets with POSCORR, valid and invalid.

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "tests/drivers/kuka/krl/krl_verdict.h"

namespace cellcal::drivers {
namespace {

RsiFilesConfig space_config(int version, CorrectionFrame frame = CorrectionFrame::kBase) {
  RsiFilesConfig config = rsi_config(version);
  config.space.on = true;
  config.space.frame = frame;
  return config;
}

TEST(RsiSetInSpace, FitsAsItWasMadeForEveryFrameAndNoOther) {
  constexpr CorrectionFrame kFrames[] = {CorrectionFrame::kBase, CorrectionFrame::kRobRoot,
                                         CorrectionFrame::kTool};
  for (const int version : {3, 4, 6}) {
    for (const CorrectionFrame made : kFrames) {
      for (const CorrectionFrame wanted : kFrames) {
        const std::string words =
            verdict(rsi_files(space_config(version, made)), space_config(version, wanted));
        if (made == wanted) {
          EXPECT_EQ(words, "") << version;
        } else {
          EXPECT_NE(words.find("RefCorrSys of"), std::string::npos) << words;
          EXPECT_NE(words.find("correction_frame"), std::string::npos) << words;
        }
      }
    }
  }
}

TEST(RsiSetInSpace, IsReadAlikeFromContextAndModelAndHoldsNoAxiscorr) {
  const ControllerFiles files = rsi_files(space_config(3));
  const RsiContextFile context = read_rsi_context(files.at("cellcal_rsi.rsi.xml"), "context");
  const RsiContextFile model = read_rsi_model(files.at("cellcal_rsi.rsi"), "model");
  expect_alike(context, model);
  EXPECT_EQ(context.only("AXISCORR"), nullptr);
  for (const RsiObject& one : context.objects)
    EXPECT_NE(files.at("cellcal_rsi.rsi.diagram").find("//" + one.id + "\""), std::string::npos);
  for (const char* name : {"RKorr.X", "RKorr.C"})
    EXPECT_NE(files.at("cellcal_rsi_ethernet.xml").find(name), std::string::npos);
}

TEST(RsiSetInSpace, IsRefusedByFileLineAndWords) {
  const Spoiled cases[] = {
      {"cellcal_rsi_ethernet.xml", "RKorr.X\" TYPE=\"DOUBLE\" INDX=\"1\" HOLDON=\"1\"",
       "RKorr.X\" TYPE=\"DOUBLE\" INDX=\"1\" HOLDON=\"0\"", "RKorr.X has HOLDON=\"0\""},
      {"cellcal_rsi_ethernet.xml", "RKorr.B\"", "RCorr.B\"", "RECEIVE: RKorr.B is missing"},
      {"cellcal_rsi.rsix", "LowerLimX\" ParamId=\"0\" ParamValue=\"-500.0\"",
       "LowerLimX\" ParamId=\"0\" ParamValue=\"-5.0\"", "LowerLimX of PosCorr_1 is -5 mm"},
      {"cellcal_rsi.rsix", "UpperLimZ\" ParamId=\"5\" ParamValue=\"500.0\"",
       "UpperLimZ\" ParamId=\"5\" ParamValue=\"499.0\"", "UpperLimZ of PosCorr_1 is 499 mm"},
      {"cellcal_rsi.rsix", "MaxRotAngle\" ParamId=\"6\" ParamValue=\"90.0\"",
       "MaxRotAngle\" ParamId=\"6\" ParamValue=\"5.0\"", "MaxRotAngle of PosCorr_1 is 5 deg"},
      {"cellcal_rsi.rsix", "MaxTrans\" ParamId=\"0\" ParamValue=\"500.0\"",
       "MaxTrans\" ParamId=\"0\" ParamValue=\"6.0\"", "MaxTrans of PosCorrMon_1 is 6 mm"},
      {"cellcal_rsi.rsix", "\"PosCorrMon\"", "\"Other\"", "POSCORRMON is missing"},
      {"cellcal_rsi.rsix", "Name=\"RefCorrSys\"", "Name=\"Other\"",
       "RefCorrSys of PosCorr_1 is missing"},
      {"cellcal_rsi.rsix", "ObjTypeId=\"82\" ObjType=\"AxisCorrMon\"",
       "ObjTypeId=\"33\" ObjType=\"AxisCorr\"", "corrects in addition to POSCORR"},
      {"cellcal_rsi.rsix", "\"PosCorr\"", "\"AxisCorr\"",
       "corrects, but [rsi] correction is \"space\""},
      {"cellcal_rsi.rsix", "InIdx=\"1\" OutObjId=\"Ethernet_1\" OutIdx=\"1\"",
       "InIdx=\"1\" OutObjId=\"Ethernet_1\" OutIdx=\"2\"", "RKorr.Y is channel 2"},
      {"cellcal_rsi.src", "$BASE=$NULLFRAME", "$BASE=BASE_DATA[3]", "Set $BASE=$NULLFRAME"},
      {"cellcal_rsi.src", "$TOOL=$NULLFRAME", "$TOOL=TOOL_DATA[1]", "Set $TOOL=$NULLFRAME"},
  };
  expect_refused(cases, [](int version) { return space_config(version); });
}

TEST(RsiSetInSpace, WithoutThePoseOfTheTcpIsAWarning) {
  ControllerFiles files = rsi_files(space_config(4));
  replace(files, "cellcal_rsi_ethernet.xml", "DEF_RIst", "DEF_RSol");
  const std::string said = verdict(files, space_config(4));
  EXPECT_EQ(said.rfind("warned", 0), 0u) << said;
  EXPECT_NE(said.find("DEF_RIst is missing"), std::string::npos) << said;
}

TEST(RsiSetInSpace, DoesNotFitAConfigurationOfAxesNorTheOtherWayRound) {
  for (const int version : {3, 4, 6}) {
    const std::string axes = verdict(rsi_files(space_config(version)), rsi_config(version));
    EXPECT_NE(axes.find("[rsi] correction is \"axes\""), std::string::npos) << axes;
    const std::string space = verdict(rsi_files(rsi_config(version)), space_config(version));
    EXPECT_NE(space.find("[rsi] correction is \"space\""), std::string::npos) << space;
  }
}

TEST(RsiSetInSpace, OfModeRelativeIsNotMade) {
  RsiFilesConfig config = space_config(4);
  config.mode = CorrectionMode::kRelative;
  EXPECT_THROW(rsi_files(config), ConfigError);
}

}  // namespace
}  // namespace cellcal::drivers
