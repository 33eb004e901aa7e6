// Values from bytes (kernels/base/archive.h): what viscera_reader answers, and one that has every
// kind of field, as states have. The first byte says which.
#include "kernels/base/archive.h"

#include <map>
#include <memory>
#include <optional>

#include "engine/io/foreign_files.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

struct Inner {
  int number = 0;
  std::vector<std::string> words;
  static constexpr auto fields() {
    return std::tuple(field("number", &Inner::number), field("words", &Inner::words));
  }
};

struct Every {
  bool yes = false;
  double real = 0.0;
  std::string text;
  std::vector<bool> flags;
  std::vector<double> reals;
  std::vector<Inner> inners;
  std::array<Inner, 2> two;
  std::optional<Inner> maybe;
  std::unique_ptr<Inner> owned;
  std::pair<int, std::string> pair;
  std::map<std::string, std::vector<int>> map;
  Eigen::MatrixXd matrix;
  Eigen::Matrix<double, 3, Eigen::Dynamic> columns;
  static constexpr auto fields() {
    return std::tuple(
        field("yes", &Every::yes), field("real", &Every::real), field("text", &Every::text),
        field("flags", &Every::flags), field("reals", &Every::reals),
        field("inners", &Every::inners), field("two", &Every::two), field("maybe", &Every::maybe),
        field("owned", &Every::owned), field("pair", &Every::pair), field("map", &Every::map),
        field("matrix", &Every::matrix), field("columns", &Every::columns));
  }
};

template <class T>
bool reads(std::string_view input) {
  T value{};
  ByteReader reader(std::as_bytes(std::span(input)));
  viscera::read(reader, value);
  if (reader.failed() || !reader.at_end()) return false;
  // A map's keys may stand twice or in another order; the rest comes back as it was.
  const std::vector<std::byte> again = saved(value);
  expect(again.size() <= input.size(), "a value is no larger than its bytes");
  return true;
}

bool read(std::string_view input) {
  if (input.empty()) return false;
  const std::string_view rest = input.substr(1);
  switch (input.front()) {
    case 0:
      return reads<Every>(rest);
    case 1:
      return reads<TriangleSurface>(rest);
    case 2:
      return reads<LabelVolume>(rest);
    case 3:
      return reads<SmokeFileInfo>(rest);
    case 4:
      return reads<SealedContents>(rest);
    default:
      return reads<std::vector<std::string>>(rest);
  }
}

template <class T>
std::string seed(char kind, const T& value) {
  const std::vector<std::byte> bytes = saved(value);
  return kind + std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::vector<std::string> seeds() {
  Every every;
  every.text = "words";
  every.flags = {true, false};
  every.reals = {1.0, 2.0};
  every.inners = {{1, {"a", "b"}}, {2, {}}};
  every.maybe = Inner{3, {"c"}};
  every.owned = std::make_unique<Inner>();
  every.map = {{"k", {1, 2, 3}}};
  every.matrix = Eigen::MatrixXd::Identity(2, 3);
  every.columns.resize(3, 2);
  every.columns.setZero();
  SmokeFileInfo smoke;
  smoke.grids = {{"density", "float", "kg/m3"}};
  LabelVolume volume;
  volume.size = {1, 2, 1};
  volume.labels = {0, 3};
  volume.axes = Mat3::Identity();
  volume.origin = Vec3::Zero();
  volume.names = {{3, "liver"}};
  SealedContents contents;
  contents.texts = {{"device", "one"}};
  contents.doubles = {{"rows", {1.0, 2.0}}};
  return {seed(0, every),
          seed(1, TriangleSurface{{Vec3::Zero(), Vec3::Ones(), Vec3::UnitX()}, {{0, 1, 2}}}),
          seed(2, volume),
          seed(3, smoke),
          seed(4, contents),
          seed(5, std::vector<std::string>{"found", "expected"})};
}

}  // namespace

Target archive() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
