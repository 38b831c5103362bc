#include <gtest/gtest.h>

#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {
namespace {

TEST(Topics, ReadAsTheyAreWritten) {
  for (const Topic& topic :
       {Topic{{"graz", "weld-3"}, Subject::kFact, "touch"},
        Topic{{"graz", "weld_3"}, Subject::kPresence, ""}, Topic{{"7", "x"}, Subject::kStored, ""},
        Topic{{"7", "x"}, Subject::kProposal, "p-1"}})
    EXPECT_EQ(topic_of(to_text(topic)), topic) << to_text(topic);
  EXPECT_EQ(to_text({{"graz", "weld-3"}, Subject::kFact, "touch"}),
            "cellcal/graz/weld-3/fact/touch");
}

TEST(Topics, OfOthersAreNone) {
  for (const char* text :
       {"", "/", "cellcal", "cellcal/graz/weld-3", "cellcal/graz/weld-3/",
        "cellcal//weld-3/presence", "cellcal/graz/+/presence", "cellcal/graz/#",
        "cellcal/graz/weld-3/fact", "cellcal/graz/weld-3/fact/",
        "cellcal/graz/weld-3/fact/touch/more", "cellcal/graz/weld-3/presence/more",
        "cellcal/graz/weld-3/proposal", "cellcal/graz/weld-3/stored/1",
        "other/graz/weld-3/presence", "$SYS/broker/uptime", "cellcal/graz/weld 3/presence",
        "cellcal/gr\xc3\xa4z/weld/presence", "Cellcal/a/b/presence"})
    EXPECT_FALSE(topic_of(text)) << text;
}

TEST(Topics, ANameThatIsTooLongIsNone) {
  EXPECT_TRUE(is_name(std::string(kLongestName, 'a')));
  EXPECT_FALSE(is_name(std::string(kLongestName + 1, 'a')));
  EXPECT_FALSE(is_name(""));
  EXPECT_FALSE(is_name(std::string_view("a\0b", 3)));
}

TEST(Base64, GivesBackWhatItWasMadeOf) {
  // RFC 4648, section 10
  for (const auto& [bytes, text] : {std::pair{"", ""},
                                    {"f", "Zg=="},
                                    {"fo", "Zm8="},
                                    {"foo", "Zm9v"},
                                    {"foob", "Zm9vYg=="},
                                    {"fooba", "Zm9vYmE="},
                                    {"foobar", "Zm9vYmFy"}}) {
    EXPECT_EQ(to_base64(bytes), text);
    EXPECT_EQ(from_base64(text), bytes);
  }
  std::string all;
  for (int i = 0; i < 1000; ++i) all += static_cast<char>(i);
  EXPECT_EQ(from_base64(to_base64(all)), all);
}

TEST(Base64, TextThatIsNoneIsRefused) {
  for (const char* text : {"Z", "Zg", "Zg=", "Zg===", "Z===", "====", "Zm9v\n", " Zm9v", "Zm=v",
                           "Zm9v====", "Zh==", "Zm9v!g=="})
    EXPECT_FALSE(from_base64(text)) << text;
}

}  // namespace
}  // namespace cellcal::daemon::plant
