#include "kernels/base/finite.h"

#include <gtest/gtest.h>

#include <limits>

namespace viscera {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Grain {
  Vec3f place = Vec3f::Zero();
  float mass = 1.0f;
  static constexpr auto fields() {
    return std::tuple(field("place", &Grain::place), field("mass", &Grain::mass));
  }
};
static_assert(fields_cover<Grain>());

/// Numbers of several kinds.
struct Parcel {
  std::uint64_t label = ~std::uint64_t{0};
  double weight = 1.0;
  float worth = 2.0f;
  std::int32_t shelf = -1;
  static constexpr auto fields() {
    using P = Parcel;
    return std::tuple(field("label", &P::label), field("weight", &P::weight),
                      field("worth", &P::worth), field("shelf", &P::shelf));
  }
};
static_assert(fields_cover<Parcel>());

/// Keeps what lasts in a State.
class Shelf {
 public:
  struct State {
    std::vector<double> heights{1.0, 2.0};
    static constexpr auto fields() { return std::tuple(field("heights", &State::heights)); }
  };
  const State& state() const { return state_; }
  void restore(State state) { state_ = std::move(state); }

 private:
  State state_;
};

struct Heap {
  std::uint64_t number = ~std::uint64_t{0};  // its bits are no number that isn't finite
  std::vector<Grain> grains{3};
  std::vector<Parcel> parcels{5};
  std::optional<Pose> pose = Pose();
  MatrixX matrix = MatrixX::Ones(2, 2);
  std::unique_ptr<Shelf> box = std::make_unique<Shelf>();
  std::map<int, double> by_key{{7, 1.0}, {9, 2.0}};
  std::array<std::vector<float>, 2> pairs{{{1.0f}, {2.0f, 3.0f}}};
  static constexpr auto fields() {
    using H = Heap;
    return std::tuple(field("number", &H::number), field("grains", &H::grains),
                      field("parcels", &H::parcels), field("pose", &H::pose),
                      field("matrix", &H::matrix), field("box", &H::box),
                      field("by_key", &H::by_key), field("pairs", &H::pairs));
  }
};

std::string stray_in(const Heap& heap) {
  const auto stray = first_stray(heap);
  return stray ? stray->field : "none";
}

TEST(FirstStray, ThereIsNoneWhereAllIsFinite) {
  EXPECT_EQ(stray_in(Heap()), "none");
}

TEST(FirstStray, IsNamedWhereverItHides) {
  const std::pair<const char*, void (*)(Heap&)> cases[] = {
      {"grains[2].place[1]", [](Heap& h) { h.grains[2].place.y() = static_cast<float>(kNan); }},
      {"grains[0].mass", [](Heap& h) { h.grains[0].mass = -static_cast<float>(kInfinite); }},
      {"parcels[4].weight", [](Heap& h) { h.parcels[4].weight = kNan; }},
      {"parcels[1].worth", [](Heap& h) { h.parcels[1].worth = static_cast<float>(kInfinite); }},
      {"pose.orientation[3]", [](Heap& h) { h.pose->orientation.w() = kNan; }},
      {"matrix[2]", [](Heap& h) { h.matrix(0, 1) = kInfinite; }},
      {"box.heights[1]",
       [](Heap& h) {
         h.box->restore({{1.0, kNan}});
       }},
      {"by_key[1]", [](Heap& h) { h.by_key[9] = kNan; }},
      {"pairs[1][0]", [](Heap& h) { h.pairs[1][0] = static_cast<float>(kInfinite); }},
  };
  for (const auto& [name, spoil] : cases) {
    Heap heap;
    spoil(heap);
    EXPECT_TRUE(stray_in(heap).starts_with(name)) << stray_in(heap) << " for " << name;
    zero_strays(heap);
    EXPECT_EQ(stray_in(heap), "none") << name;
  }
}

TEST(FirstStray, ItsValueIsTold) {
  Heap heap;
  heap.grains[1].mass = static_cast<float>(-kInfinite);
  EXPECT_EQ(first_stray(heap)->value, -kInfinite);
}

TEST(ZeroStrays, LeavesWhatIsFiniteAsItWas) {
  Heap heap;
  heap.grains[1].place = Vec3f(1.0f, static_cast<float>(kNan), 3.0f);
  zero_strays(heap);
  EXPECT_EQ(heap.grains[1].place, Vec3f(1.0f, 0.0f, 3.0f));
  EXPECT_EQ(heap.grains[1].mass, 1.0f);
  EXPECT_EQ(heap.by_key.at(7), 1.0);
}

TEST(AllFinite, GreatestAndLeastNumbersAreAndWhatIsBeyondIsNot) {
  std::vector<float> values(1000, std::numeric_limits<float>::max());
  values[3] = std::numeric_limits<float>::denorm_min();
  EXPECT_TRUE(all_finite(std::span<const float>(values)));
  for (const std::size_t at : {0u, 517u, 999u}) {
    std::vector<float> spoilt = values;
    spoilt[at] = static_cast<float>(-kInfinite);
    EXPECT_FALSE(all_finite(std::span<const float>(spoilt))) << at;
  }
  std::vector<double> doubles(999, std::numeric_limits<double>::lowest());
  EXPECT_TRUE(all_finite(std::span<const double>(doubles)));
  doubles[998] = kNan;
  EXPECT_FALSE(all_finite(std::span<const double>(doubles)));
}

}  // namespace
}  // namespace viscera
