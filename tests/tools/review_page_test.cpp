// review.html in a browser: its scripts run, and film, curves and moments go together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "engine/gpu/egl_context.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// The browser's name, or nothing.
std::string browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
    if (run_command({name, "--version"}).code == 0) return name;
  return {};
}

class ReviewPage : public testing::Test {
 protected:
  void SetUp() override {
    browser_ = browser();
    if (browser_.empty()) GTEST_SKIP() << "there is no Chromium on the PATH";
  }

  /// Opens a copy of the page that runs `steps` (the body of an async function, which may use the
  /// page's own names and fills `told`) and gives back `told`, with the errors of all scripts.
  Json ask(const fs::path& page, const std::string& steps) const {
    std::string text = file_text(page);
    const auto put_after = [&text](const std::string& mark, const std::string& what, bool behind) {
      const std::size_t at = text.rfind(mark);
      ASSERT_NE(at, std::string::npos) << mark;
      text.insert(at + (behind ? mark.size() : 0), what);
    };
    put_after("<meta charset=\"utf-8\">", kWatchErrors, true);
    put_after("</body>", kBefore + steps + kAfter, false);
    const TemporaryFolder folder;
    const fs::path copy = folder / "asked.html";
    std::ofstream(copy, std::ios::binary) << text;
    const ProgramResult shown = run_command(
        {browser_, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
         "--disable-background-networking", "--user-data-dir=" + (folder / "profile").string(),
         "--window-size=1300,1800", "--dump-dom", "file://" + copy.string()});
    const std::string open = "<pre id=\"told\">";
    const std::size_t begin = shown.out.find(open);
    if (begin == std::string::npos) {
      ADD_FAILURE() << "the page said nothing; exit code " << shown.code << "\n" << shown.err;
      return nullptr;
    }
    const std::size_t end = shown.out.find("</pre>", begin);
    return Json::parse(shown.out.substr(begin + open.size(), end - begin - open.size()));
  }

 private:
  static inline const std::string kWatchErrors = R"(<script>
const errors = [];
addEventListener("error", event => errors.push(event.message || "an element"), true);
addEventListener("unhandledrejection", event => errors.push(String(event.reason)));
</script>)";
  // A document that stays open holds the page's load event, and --dump-dom waits for that.
  static inline const std::string kBefore = R"(<script>
(async () => {
  const gate = document.createElement("iframe");
  document.body.append(gate);
  gate.contentDocument.open();
  const told = {errors};
  const until = async what => {
    for (let i = 0; i < 400 && !what(); ++i) await new Promise(done => setTimeout(done, 25));
    return Boolean(what());
  };
  const settled = () => until(() => !video || !video.seeking);
  const state = () => ({
    step: clock.step,
    film: video ? Math.floor(video.currentTime * rate + 1e-3) : null,
    slider: Number(document.querySelector(".scrub input").value),
    cursors: [...document.querySelectorAll("svg .cursor")].map(c => Number(c.getAttribute("x1"))),
  });
  const key = name => document.dispatchEvent(new KeyboardEvent("keydown", {key: name}));
  const slide = step => {
    const slider = document.querySelector(".scrub input");
    slider.value = step;
    slider.dispatchEvent(new Event("input"));
  };
  const clickCurve = share => {
    const svg = document.querySelector("svg"), box = svg.getBoundingClientRect();
    const x = (54 + (1160 - 64) * share) / 1160;  // within the axes
    svg.dispatchEvent(new PointerEvent("pointerdown",
      {clientX: box.left + box.width * x, clientY: box.top + box.height / 2, button: 0}));
  };
  try {
)";
  static inline const std::string kAfter = R"(
  } catch (error) { errors.push(String(error)); }
  const pre = document.createElement("pre");
  pre.id = "told";
  pre.textContent = JSON.stringify(told).replaceAll("<", "\\u003c").replaceAll("&", "\\u0026");
  document.body.append(pre);
  gate.contentDocument.close();
})();
</script>)";
  std::string browser_;
};

/// Film, slider and the cursors of all curves are at this step.
void expect_at(const Json& state, int step, bool film) {
  EXPECT_EQ(state["step"], step) << state;
  EXPECT_EQ(state["slider"], step) << state;
  EXPECT_TRUE(!film || state["film"] == step) << state;
  ASSERT_EQ(state["cursors"].size(), 7u)
      << "force, penetration, displacement, power, temperature, cavity, stages: " << state;
  // 0.2 s over 1096 of the drawing's units; the first step is the state a step after the start.
  const double steps = film ? 6.0 : 12.0;
  for (const Json& cursor : state["cursors"])
    EXPECT_NEAR(cursor.get<double>(), 54.0 + 1096.0 * (step + 1) / steps, 1.5) << state;
}

TEST_F(ReviewPage, CursorFollowsTheFilmAndAClickSeeks) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const SceneFolder folder;
  const ProgramResult result = folder.run();
  ASSERT_EQ(result.code, 0) << result.told();
  // The page alone, as one sends it by mail.
  fs::rename(folder.out() / "film.mp4", folder / "elsewhere.mp4");
  const Json told = ask(folder.out() / "review.html", R"(
    told.plays = await until(() => video.readyState >= 2 || video.error !== null) && !video.error;
    told.size = [video.videoWidth, video.videoHeight];
    told.start = state();
    slide(4); await settled(); told.slid = state();
    key("ArrowLeft"); await settled(); told.stepped = state();
    clickCurve(0.3); await settled(); told.clicked = state();
    const moments = [...document.querySelectorAll(".moment")];
    told.moments = moments.map(m => m.querySelector("b").textContent);
    told.pictures = moments.map(m => [m.querySelector("img").naturalWidth,
                                      m.querySelector("img").naturalHeight]);
    moments[0].click(); await settled(); told.moment = state();
    told.current = moments[0].getAttribute("aria-current");
    key("Home"); await settled();
    video.playbackRate = 0.1;
    key(" ");
    told.moved = await until(() => clock.step >= 2);
    video.pause();
    told.played = state();
  )");
  ASSERT_TRUE(told.is_object());
  EXPECT_TRUE(told["errors"].empty()) << told["errors"];
  ASSERT_EQ(told["plays"], true) << "the film in the page";
  EXPECT_EQ(told["size"], Json::parse("[1280, 720]"));
  expect_at(told["start"], 0, true);
  expect_at(told["slid"], 4, true);
  expect_at(told["stepped"], 3, true);
  expect_at(told["clicked"], 1, true);
  EXPECT_EQ(told["current"], "true");
  EXPECT_EQ(told["moved"], true) << "the cursor follows the film that plays";
  EXPECT_EQ(told["played"]["slider"], told["played"]["step"]);

  const auto& moments = told["moments"];
  for (const char* moment : {"First contact", "Peak force", "First smoke"})
    EXPECT_NE(std::find(moments.begin(), moments.end(), moment), moments.end()) << moments;
  for (const Json& size : told["pictures"]) EXPECT_EQ(size, Json::parse("[320, 180]"));
}

TEST_F(ReviewPage, WithoutAFilmTheCurvesKeepTheirCursor) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  const Json told = ask(folder.out() / "review.html", R"(
    told.start = state();
    slide(7); told.slid = state();
    clickCurve(0.49); told.clicked = state();
    told.says = document.querySelector(".player").textContent;
    told.curves = [...document.querySelectorAll(".chart h3")].map(h => h.firstChild.textContent);
    told.organ = document.querySelector("td .moved span").textContent;
    told.values = document.querySelector(".legend b").textContent;
    told.shown = [3.92e-9, -3.92e-9, 0, 0.0000123, 0.00345, 0.9999, 12.345, -0.25]
      .map(force => quantity(force, "N"));
    told.lengths = [0.0000004, 0.0123, 4.5678, null].map(length => quantity(length, "mm"));
    told.times = [0.0421, 16.7, 2100].map(time => quantity(time, "ms"));
    told.flat = linearAxis(0, 3.92e-9, "N").ticks.map(tick => tick[1]);
    document.querySelector(".legend button").click();
    told.hidden = document.querySelectorAll("svg g[visibility=hidden]").length;
    told.command = document.querySelector("pre").textContent;
  )");
  ASSERT_TRUE(told.is_object());
  EXPECT_TRUE(told["errors"].empty()) << told["errors"];
  expect_at(told["start"], 0, false);
  expect_at(told["slid"], 7, false);
  expect_at(told["clicked"], 5, false);
  EXPECT_NE(told["says"].get<std::string>().find("No film"), std::string::npos);
  EXPECT_EQ(told["curves"], Json::parse(R"(["Force on the instruments", "Penetration of the tips",
                                            "Greatest displacement", "Power into tissue",
                                            "Hottest tissue", "Pressure of the cavity",
                                            "Time per stage"])"));
  EXPECT_TRUE(told["organ"].get<std::string>().ends_with(" mm")) << told["organ"];
  EXPECT_TRUE(told["values"].get<std::string>().ends_with("N")) << told["values"];
  EXPECT_EQ(told["shown"], Json::parse(R"(["0 N", "0 N", "0 N", "12.3 µN", "3.45 mN", "1 N",
                                           "12.3 N", "-250 mN"])"));
  EXPECT_EQ(told["lengths"], Json::parse(R"(["0 mm", "0.0123 mm", "4.57 mm", "not a number"])"));
  EXPECT_EQ(told["times"], Json::parse(R"(["42.1 µs", "16.7 ms", "2.1 s"])"));
  for (const Json& tick : told["flat"])
    EXPECT_LE(tick.get<std::string>().size(), 4u) << "forces of rounding fill no axis " << tick;
  EXPECT_EQ(told["hidden"], 1);
  EXPECT_EQ(told["command"], folder.report()["command"]);
}

TEST_F(ReviewPage, AScriptThatFailsIsSeenByThisTest) {
  const SceneFolder folder;
  std::ofstream(folder / "page.html")
      << "<!DOCTYPE html><html><head><meta charset=\"utf-8\"></head><body>"
         "<script>nothing.of(this);</script></body></html>";
  const Json told = ask(folder / "page.html", "");
  ASSERT_TRUE(told.is_object());
  EXPECT_EQ(told["errors"].size(), 1u) << told;
}

}  // namespace
}  // namespace viscera::test
