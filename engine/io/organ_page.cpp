#include "engine/io/organ_page.h"

namespace viscera {
namespace {

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --page: #f6f5f3; --card: #fff; --ink: #1d1f23; --soft: #62666e;
  --line: #e0dedb; --warn-back: #fdf3dc; --warn: #7a5200; --bad: #8f1f17; --good: #2c7a51; }
@media (prefers-color-scheme: dark) { :root { --page: #15171a; --card: #1e2125; --ink: #e8e6e3;
  --soft: #9da2aa; --line: #32363c; --warn-back: #3a2f16; --warn: #f0cd83; --bad: #f5aaa3;
  --good: #6cc493; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 860px; margin: 0 auto; padding: 28px 20px 48px; }
h1 { font-size: 24px; margin: 0; } h2 { font-size: 16px; margin: 0 0 8px; }
.soft { color: var(--soft); }
section { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: 16px 18px; margin-top: 16px; overflow-x: auto; }
.warn { background: var(--warn-back); color: var(--warn); }
ul { margin: 0; padding-left: 20px; }
table { border-collapse: collapse; width: 100%; }
td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
tr:last-child td { border-bottom: 0; }
td:nth-child(2) { white-space: nowrap; font-variant-numeric: tabular-nums; }
.bad { color: var(--bad); font-weight: 600; } .good { color: var(--good); }
.views { display: flex; gap: 12px; flex-wrap: wrap; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: 13px; text-align: center; }
img { border-radius: 6px; background: #fff; display: block; }
pre { margin: 0; font-size: 13px; }
)";

}  // namespace

std::string page_text(const OrganPage& page) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      escaped(page.title) + "</title>\n<style>" + kStyle +
      "</style>\n</head>\n<body>\n<main>\n<h1>" + escaped(page.title) +
      "</h1>\n<div class=\"soft\">" + escaped(page.source) + "</div>\n";
  if (page.warnings.empty()) {
    out += "<section><span class=\"good\">Nothing stands against using it.</span></section>\n";
  } else {
    out += "<section class=\"warn\"><h2>What to look at before using it</h2>\n<ul>\n";
    for (const std::string& warning : page.warnings) {
      out += "<li>" + escaped(warning) + "</li>\n";
    }
    out += "</ul></section>\n";
  }
  if (!page.pictures.empty()) {
    out += "<section class=\"views\">\n";
    for (const OrganPage::Picture& picture : page.pictures) {
      out += "<figure><img alt=\"" + escaped(picture.caption) + "\" src=\"" + picture.uri +
             "\"><figcaption>" + escaped(picture.caption) + "</figcaption></figure>\n";
    }
    out += "</section>\n";
  }
  out += "<section><h2>Figures</h2>\n<table>\n";
  for (const OrganPage::Figure& figure : page.figures) {
    out += "<tr><td>" + escaped(figure.what) + "</td><td" + (figure.bad ? " class=\"bad\"" : "") +
           ">" + escaped(figure.value) + "</td><td class=\"soft\">" + escaped(figure.remark) +
           "</td></tr>\n";
  }
  out += "</table></section>\n<section><h2>Entry for a scene's organs</h2>\n<pre>" +
         escaped(page.entry) + "</pre></section>\n</main>\n</body>\n</html>\n";
  return out;
}

}  // namespace viscera
