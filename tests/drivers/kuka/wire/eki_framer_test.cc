#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::drivers {
namespace {

struct Cut {
  std::vector<std::string> documents;
  int oversized = 0;
};

Cut feed(EkiFramer& framer, std::string_view bytes) {
  Cut cut;
  for (const char c : bytes) {
    const EkiFramer::Event event = framer.push(c);
    if (event == EkiFramer::Event::kDocument) cut.documents.emplace_back(framer.document());
    if (event == EkiFramer::Event::kOversized) {
      ++cut.oversized;
      break;
    }
  }
  return cut;
}

std::vector<std::string> documents(std::string_view bytes) {
  EkiFramer framer;
  return feed(framer, bytes).documents;
}

using Documents = std::vector<std::string>;

TEST(EkiFramer, FindsDocumentsThatComeTogether) {
  EXPECT_EQ(documents("<R a=\"1\"><B/></R><R>2</R>"),
            (Documents{"<R a=\"1\"><B/></R>", "<R>2</R>"}));
}

TEST(EkiFramer, FindsADocumentHoweverItIsSplit) {
  const std::string text = "<R x='1'><A A1=\"2\"></A></R>";
  for (std::size_t split = 0; split <= text.size(); ++split) {
    EkiFramer framer;
    Documents found = feed(framer, text.substr(0, split)).documents;
    for (const std::string& one : feed(framer, text.substr(split)).documents) found.push_back(one);
    EXPECT_EQ(found, Documents{text}) << split;
  }
}

TEST(EkiFramer, KnowsSelfClosedRootsAndSlashesInAttributes) {
  EXPECT_EQ(documents("<R a=\"b/>c\"/><R/>"), (Documents{"<R a=\"b/>c\"/>", "<R/>"}));
}

TEST(EkiFramer, SkipsPrologPaddingAndBlanks) {
  const std::string padded = std::string("<?xml version=\"1.0\"?>\r\n<R>1</R>") +
                             std::string(20, '\0') + "\r\n <!-- --><R>2</R>";
  EXPECT_EQ(documents(padded), (Documents{"<R>1</R>", "<R>2</R>"}));
}

TEST(EkiFramer, IsNotMisledByElementsWhoseNamesBeginLikeTheRoots) {
  EXPECT_EQ(documents("<R><RR>1</RR><Rx></Rx></R >"), (Documents{"<R><RR>1</RR><Rx></Rx></R >"}));
}

TEST(EkiFramer, GoesOnBehindGarbage) {
  EXPECT_EQ(documents("abc</R><R>1</R>"), Documents{"<R>1</R>"});
}

TEST(EkiFramer, GivesUpWhereADocumentDoesNotEnd) {
  EkiFramer framer;
  EXPECT_EQ(feed(framer, "<R>" + std::string(2 * kMaxEkiDocument, 'x')).oversized, 1);
  framer.reset();
  EXPECT_EQ(feed(framer, std::string(2 * kMaxEkiDocument, 'x')).oversized, 1);
  framer.reset();
  EXPECT_EQ(feed(framer, "<?" + std::string(2 * kMaxEkiDocument, 'x')).oversized, 1);
}

TEST(EkiFramer, TakesTheLargestDocumentAndNoByteMore) {
  const std::string frame = "<R></R>";
  const std::string largest = "<R>" + std::string(kMaxEkiDocument - frame.size(), 'x') + "</R>";
  EXPECT_EQ(documents(largest), Documents{largest});
  EkiFramer framer;
  EXPECT_EQ(feed(framer, "<R>x" + largest.substr(3)).oversized, 1);
}

}  // namespace
}  // namespace cellcal::drivers
