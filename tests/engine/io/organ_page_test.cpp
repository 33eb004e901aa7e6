#include "engine/io/organ_page.h"

#include <gtest/gtest.h>

namespace viscera::test {
namespace {

TEST(OrganPage, ShowsFiguresAndWarningsAsText) {
  OrganPage page;
  page.title = "liver <1>";
  page.source = "label 5 of \"a & b\"";
  page.figures = {{"volume", "12 ml", "the labels' 11 ml", true}};
  page.warnings = {"it overlaps stomach & spleen"};
  page.pictures = {{"from the front", "data:image/bmp;base64,AAAA"}};
  page.entry = "{\"name\": \"liver\"}";
  const std::string text = page_text(page);
  EXPECT_NE(text.find("<title>liver &lt;1&gt;</title>"), std::string::npos);
  EXPECT_NE(text.find("label 5 of &quot;a &amp; b&quot;"), std::string::npos);
  EXPECT_NE(text.find("<td class=\"bad\">12 ml</td>"), std::string::npos);
  EXPECT_NE(text.find("<li>it overlaps stomach &amp; spleen</li>"), std::string::npos);
  EXPECT_NE(text.find("src=\"data:image/bmp;base64,AAAA\""), std::string::npos);
  EXPECT_TRUE(text.ends_with("</html>\n"));
}

TEST(OrganPage, SaysWhenNothingIsWrong) {
  EXPECT_NE(page_text({}).find("Nothing stands against using it."), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
