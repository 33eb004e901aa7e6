#include "kernels/base/archive.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

struct Spot {
  Vec3 rest = Vec3::Zero();
  int triangle = -1;
  bool held = false;
  static constexpr auto fields() {
    return std::tuple(field("rest", &Spot::rest), field("triangle", &Spot::triangle),
                      field("held", &Spot::held));
  }
};
static_assert(fields_cover<Spot>());
static_assert(!is_flat<Spot>(), "padding isn't part of a value");

struct Forgetful {
  double told = 0.0, untold = 0.0;
  static constexpr auto fields() { return std::tuple(field("told", &Forgetful::told)); }
};
static_assert(!fields_cover<Forgetful>());

struct Body {
  std::vector<Spot> spots;
  std::vector<Vec3f> vertices;
  std::vector<bool> seen;
  std::optional<Pose> pose;
  std::unique_ptr<Spot> warm;
  std::map<int, std::string> names;
  MatrixX matrix;
  std::array<float, 3> border{};
  static constexpr auto fields() {
    return std::tuple(field("spots", &Body::spots), field("vertices", &Body::vertices),
                      field("seen", &Body::seen), field("pose", &Body::pose),
                      field("warm", &Body::warm), field("names", &Body::names),
                      field("matrix", &Body::matrix), field("border", &Body::border));
  }
};
static_assert(fields_cover<Body>());

class Counter {
 public:
  struct State {
    int count = 0;
    static constexpr auto fields() { return std::tuple(field("count", &State::count)); }
  };
  const State& state() const { return state_; }
  void restore(State state) { state_ = state; }
  void add() { ++state_.count; }

 private:
  State state_;
};

Body full_body() {
  Body body;
  body.spots = {{Vec3(1, 2, 3), 4, true}, {Vec3(5, 6, 7), 8, false}};
  body.vertices = {Vec3f(1, 2, 3), Vec3f(4, 5, 6)};
  body.seen = {true, false, true};
  body.pose = Pose{Vec3(1, 0, 0), Quaternion(Eigen::AngleAxisd(0.3, Vec3::UnitX()))};
  body.warm = std::make_unique<Spot>(Spot{Vec3(9, 9, 9), 1, true});
  body.names = {{1, "liver"}, {2, ""}};
  body.matrix = MatrixX::Random(3, 2);
  body.border = {1, 2, 3};
  return body;
}

std::string hash_of(const Body& body) {
  Hasher hasher;
  write(hasher, body);
  return hasher.hex();
}

TEST(Archive, GivesBackWhatItWasGivenBitForBit) {
  const Body body = full_body();
  const std::vector<std::byte> bytes = saved(body);
  Body other;
  other.spots.resize(7);
  ByteReader reader(bytes);
  read(reader, other);
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(first_difference(body, other), "");
  EXPECT_EQ(hash_of(body), hash_of(other));
  EXPECT_EQ(saved_bytes(body), bytes.size());
}

TEST(Archive, NamesTheFirstFieldThatDiffers) {
  const Body body = full_body();
  Body other = full_body();
  other.matrix = body.matrix;
  other.spots[1].rest.y() = std::nextafter(6.0, 7.0);
  EXPECT_EQ(first_difference(body, other), "spots[1].rest");
  EXPECT_NE(hash_of(body), hash_of(other));
  other.spots.pop_back();
  EXPECT_EQ(first_difference(body, other), "spots[size]");
}

TEST(Archive, RefusesBytesThatEndEarlyWhereverTheyEnd) {
  const std::vector<std::byte> bytes = saved(full_body());
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    Body body;
    ByteReader reader(std::span<const std::byte>(bytes).first(n));
    read(reader, body);
    EXPECT_TRUE(reader.failed()) << n;
  }
}

TEST(Archive, TakesNoMemoryForCountsThatTheFileCannotHold) {
  ByteWriter writer;
  write(writer, std::uint64_t{1} << 60);
  const std::vector<std::byte> bytes = writer.take();
  std::vector<double> numbers;
  ByteReader reader(bytes);
  read(reader, numbers);
  EXPECT_TRUE(reader.failed());
  EXPECT_TRUE(numbers.empty());
}

TEST(Archive, RefusesAMatrixThatIsLargerThanItsStorage) {
  using Small = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;
  for (const int rows : {4, 5, 5000}) {
    const std::vector<std::byte> bytes = saved(VectorX(VectorX::Ones(rows)));
    Small small;
    ByteReader reader(bytes);
    read(reader, small);
    EXPECT_EQ(reader.failed(), rows > 4) << rows;
    EXPECT_EQ(small.size(), rows > 4 ? 0 : rows);
  }
}

TEST(Archive, ReachesTheStateOfClassesThatOwnOne) {
  std::vector<Counter> counters(2);
  counters[1].add();
  const std::vector<std::byte> bytes = saved(counters);
  std::vector<Counter> other;
  ByteReader reader(bytes);
  read(reader, other);
  ASSERT_EQ(other.size(), 2u);
  EXPECT_EQ(other[1].state().count, 1);
  other[0].add();
  EXPECT_EQ(first_difference(counters, other), "[0].count");
}

TEST(Archive, TellsLayoutsApartByNamesAndKinds) {
  EXPECT_EQ(layout_of<Spot>(), "{rest:b24,triangle:b4,held:b1,}");
  EXPECT_NE(layout_of<Spot>(), layout_of<Body>());
  EXPECT_EQ(layout_of<std::vector<Counter>>(), "*{count:b4,}");
}

}  // namespace
}  // namespace viscera
