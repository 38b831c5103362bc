#include <gtest/gtest.h>

#include <string>

#include "calib/export/svg.h"

namespace cellcal::svg {
namespace {

TEST(Escape, MakesMarkupHarmlessInTextAndAttributes) {
  EXPECT_EQ(escape("<script>alert(\"1\" & '2')</script>"),
            "&lt;script&gt;alert(&quot;1&quot; &amp; &#39;2&#39;)&lt;/script&gt;");
}

TEST(Escape, EscapesWhatLooksEscapedAlready) { EXPECT_EQ(escape("&lt;"), "&amp;lt;"); }

TEST(Escape, KeepsLettersOfAnyLanguage) {
  EXPECT_EQ(escape("Zelle \xC3\xA4 \xE5\xAE\xA4 \xF0\x9F\xA4\x96"),
            "Zelle \xC3\xA4 \xE5\xAE\xA4 \xF0\x9F\xA4\x96");
}

TEST(Escape, ReplacesControlCharacters) {
  EXPECT_EQ(escape(std::string_view("a\0b\x1B[31m\x7F", 9)),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD[31m\xEF\xBF\xBD");
}

TEST(Escape, ReplacesBidirectionalOverrides) {
  EXPECT_EQ(escape("S1\xE2\x80\xAE"
                   "x"),
            "S1\xEF\xBF\xBDx");
  EXPECT_EQ(escape("\xE2\x81\xA6"), "\xEF\xBF\xBD");
}

TEST(Escape, ReplacesBrokenUtf8ByteByByte) {
  EXPECT_EQ(escape("\xFF"), "\xEF\xBF\xBD");
  EXPECT_EQ(escape("\xE2\x82"), "\xEF\xBF\xBD\xEF\xBF\xBD");              // truncated
  EXPECT_EQ(escape("\xC0\xBC"), "\xEF\xBF\xBD\xEF\xBF\xBD");              // overlong '<'
  EXPECT_EQ(escape("\xED\xA0\x80").find("\xED"), std::string::npos);      // surrogate
  EXPECT_EQ(escape("\xF5\x80\x80\x80").find("\xF5"), std::string::npos);  // beyond U+10FFFF
}

TEST(Escape, DoesNotSwallowMarkupBehindATruncatedCharacter) {
  EXPECT_EQ(escape("\xE2<b>"), "\xEF\xBF\xBD&lt;b&gt;");
}

TEST(Shorten, CountsCharactersNotBytes) {
  EXPECT_EQ(shorten("\xC3\xA4\xC3\xA4\xC3\xA4", 3), "\xC3\xA4\xC3\xA4\xC3\xA4");
  EXPECT_EQ(shorten("\xC3\xA4\xC3\xA4\xC3\xA4", 2), "\xC3\xA4\xE2\x80\xA6");
  EXPECT_EQ(shorten("S1", 14), "S1");
  EXPECT_EQ(shorten("", 3), "");
}

}  // namespace
}  // namespace cellcal::svg
