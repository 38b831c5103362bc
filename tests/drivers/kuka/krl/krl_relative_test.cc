// The controller's files for RSI_ON(#RELATIVE).

#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <set>

#include "drivers/kuka/krl/krl_files.h"
#include "tests/drivers/kuka/krl/krl_checker.h"

namespace cellcal::drivers {
namespace {

TEST(RsiFiles, OfModeRelativeDoNotHoldOn) {
  RsiFilesConfig config;
  config.pc_address = "192.168.1.10";
  config.mode = CorrectionMode::kRelative;
  const ControllerFiles files = rsi_files(config);
  const std::string& program = files.at("cellcal_rsi.src");
  EXPECT_NE(program.find("RSI_ON(#RELATIVE,#IPO_FAST)"), std::string::npos);
  for (const std::string& complaint : krl::check_krl(program)) ADD_FAILURE() << complaint;
  pugi::xml_document document;
  const std::string& text = files.at("cellcal_rsi_ethernet.xml");
  ASSERT_TRUE(document.load_buffer(text.data(), text.size()));
  std::size_t elements = 0;
  for (const auto& one : document.select_nodes("/ROOT/RECEIVE/ELEMENTS/ELEMENT/@HOLDON")) {
    EXPECT_EQ(one.attribute().value(), std::string("0"));
    ++elements;
  }
  EXPECT_EQ(elements, 7U) << "six axes and the stop";
}

}  // namespace
}  // namespace cellcal::drivers
