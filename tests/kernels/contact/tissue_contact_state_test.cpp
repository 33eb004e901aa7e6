// What contact keeps from call to call: written, read again, and gone on from to the same bits.
#include "kernels/contact/tissue_contact_state.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "engine/verification/changed_body.h"
#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "kernels/contact/patch_contact.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

using test::block, test::kTissue, test::kTop;

std::vector<ContactCell> held_cells(int count) {
  std::vector<ContactCell> cells(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    ContactCell& cell = cells[static_cast<std::size_t>(k)];
    cell.position = Vec3(6e-3 * k - 7e-3, 4e-3, kTop);
    cell.area = 9e-6;
    cell.held = true;
  }
  return cells;
}

/// A tip that rubs, stays, sinks and comes back, other tools beside it; with springs, the ends of
/// these as well.
class Press {
 public:
  static constexpr int kFrames = 56;

  explicit Press(int springs = 0) : springs_(held_cells(springs)) { contact.anchor(springs_); }

  PatchContact contact{block().compliance, block().touch, kTissue};

  /// Everything that frame `i` leaves and anybody can ask for.
  std::string frame(int i) {
    std::vector<ContactCell> cells = tools(i);
    for (std::size_t k = 0; k < springs_.size(); ++k) {
      cells.push_back(springs_[k]);
      cells.back().displacement = Vec3(1e-5 * i, 0, 1e-5 * static_cast<double>(k));
    }
    const auto size = static_cast<Eigen::Index>(3 * springs_.size());
    const MatrixX backing = 2e-3 * MatrixX::Identity(size, size);
    contact.solve(cells, solution_, response_, backing);
    // As jaws that slip are: solved once more in the same frame.
    if (i % 7 == 3) contact.solve(cells, solution_, response_, backing);
    if (i >= 44 && i < 47 && solution_.converged) {
      std::vector<Vec3> forces = solution_.forces;
      for (Vec3& force : forces) force *= 0.9;
      contact.load(cells, forces, solution_, response_);
    }
    Hasher hasher;
    if (solution_.touching > 0 || i % 2 == 0) {
      contact.place_displacements(displacements_);
      write(hasher, displacements_);
    }
    write(hasher, solution_.forces);
    write(hasher, solution_.slips);
    write(hasher, response_);
    write(hasher, contact.cell_displacements());
    write(hasher, contact.state());
    for (const NearField& near : solution_.near_fields) hasher.value(near.sigma());
    hasher.value(solution_.touching).value(solution_.pivots).value(solution_.converged);
    for (const double figure :
         {solution_.smallest_eigenvalue, solution_.lifted, solution_.residual, solution_.violation})
      hasher.value(figure);
    return hasher.hex();
  }

 private:
  std::vector<ContactCell> tools(int i) {
    const double x = i < 6 ? 0.3e-3 * i : 1.5e-3;
    std::vector<ContactCell> cells;
    if (i == 36 || i == 37) return cells;
    cells = test::plane_cells(Vec3(x, 0, kTop), 0.4e-3, 2, 1e-3, 0.3e-3 + 2e-6 * (i % 5));
    for (std::size_t k = 0; k < cells.size(); ++k) {
      cells[k].friction = i < 16 || i >= 48 ? 0.4 : 0.0;
      cells[k].held = i >= 30 && i < 34 && k % 2 == 0;
      cells[k].displacement = Vec3(1e-5 * (i % 9), 0, cells[k].held ? -1e-4 : 0.0);
      cells[k].free = Vec3(0, 0, -1e-6 * (i % 4));
    }
    if (i >= 42 && i < 48) {
      for (const double pitch : {0.2e-3, 0.7e-3}) {
        const auto more = test::plane_cells(Vec3(1e-3, 1e-3, kTop), pitch, 2, 0.0, 0.2e-3);
        cells.insert(cells.end(), more.begin(), more.end());
      }
    }
    if (i == 47) cells[3].depth = std::numeric_limits<double>::quiet_NaN();
    return cells;
  }

  std::vector<ContactCell> springs_;
  ContactSolution solution_;
  ContactResponse response_;
  std::vector<float> displacements_;
};

void give(const std::vector<std::byte>& bytes, PatchContact& to) {
  ByteReader reader(bytes);
  PatchContact::State state;
  read(reader, state);
  ASSERT_FALSE(reader.failed());
  ASSERT_TRUE(reader.at_end());
  ASSERT_TRUE(to.fits(state));
  to.restore(std::move(state));
}

class TissueContactState : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { ASSERT_TRUE(block().ready); }
};

TEST_P(TissueContactState, AnyMomentGoesOnToTheSameBits) {
  Press first(GetParam());
  std::vector<std::vector<std::byte>> states;
  std::vector<std::string> hashes;
  std::uint64_t most_columns = 0;
  for (int i = 0; i < Press::kFrames; ++i) {
    states.push_back(saved(first.contact));
    hashes.push_back(first.frame(i));
    most_columns = std::max(most_columns, first.contact.state().columns_built);
  }
  EXPECT_EQ(most_columns, 19u);
  const Random random(15, 1);
  // While it rubs, half of the columns built, all of them, gone, come back, loaded, unsound.
  std::vector<int> moments = {3, 14, 21, 29, 37, 39, 46, 48};
  for (std::uint64_t draw = 0; draw < 6; ++draw)
    moments.push_back(static_cast<int>(random.bits(draw) % Press::kFrames));
  Press other(GetParam());  // lives on from moment to moment
  for (const int moment : moments) {
    SCOPED_TRACE(moment);
    const auto at = static_cast<std::size_t>(moment);
    Press fresh(GetParam());
    for (Press* press : {&fresh, &other}) {
      give(states[at], press->contact);
      EXPECT_EQ(saved(press->contact), states[at]);
    }
    for (int i = moment; i < std::min(Press::kFrames, moment + 20); ++i) {
      ASSERT_EQ(fresh.frame(i), hashes[static_cast<std::size_t>(i)]) << i;
      if (i < moment + 5) {
        ASSERT_EQ(other.frame(i), hashes[static_cast<std::size_t>(i)]) << i;
      }
    }
  }
}

TEST_P(TissueContactState, WhatIsMadeFromItMayBeForgottenAtAnyTime) {
  Press first(GetParam()), forgetful(GetParam());
  std::size_t most_freed = 0;
  for (int i = 0; i < Press::kFrames; ++i) {
    ASSERT_EQ(first.frame(i), forgetful.frame(i)) << i;
    if (i % 3 != 1) continue;
    const std::size_t before = forgetful.contact.memory_bytes();
    forgetful.contact.forget();
    most_freed = std::max(most_freed, before - forgetful.contact.memory_bytes());
  }
  // Columns of 19 cells among it.
  EXPECT_GT(most_freed, 19 * 3 * block().compliance.rows() * sizeof(float));
}

INSTANTIATE_TEST_SUITE_P(Springs, TissueContactState, testing::Values(0, 3));

TEST(TissueContactStateOf, APatchIsSmall) {
  Press press;
  for (int i = 0; i < 36; ++i) press.frame(i);
  std::printf("state of 19 cells: %zu bytes; with what is made of it: %zu\n",
              saved_bytes(press.contact), press.contact.memory_bytes());
  EXPECT_EQ(press.contact.state().forces.size(), 19u);
  EXPECT_LT(saved_bytes(press.contact), 20000u);
}

TEST(TissueContactStateOf, ALoadRightAfterKnowsWhatMadeTheMatrixPositive) {
  // A pad so thin that tools of several sizes at one spot need it.
  const double top = 1.5e-3;
  const test::PressedBody pad =
      test::prepare_block(Vec3(0.03, 0.03, 2.0 * top), 2.5e-3, 0.01, kTissue);
  ASSERT_TRUE(pad.ready);
  std::vector<ContactCell> cells;
  for (const double pitch : {0.1e-3, 0.3e-3, 0.6e-3, 1.1e-3, 1.7e-3}) {
    const auto more = test::plane_cells(Vec3(0, 0, top), pitch, 2, 0.0, 0.1e-3);
    cells.insert(cells.end(), more.begin(), more.end());
  }
  PatchContact contact(pad.compliance, pad.touch, kTissue),
      other(pad.compliance, pad.touch, kTissue);
  ContactSolution one, two;
  ContactResponse response;
  contact.solve(cells, one, response);
  ASSERT_GT(one.lifted, 0.0);
  give(saved(contact), other);
  const std::vector<Vec3> forces(cells.size(), Vec3(0, 0, -1e-3));
  contact.load(cells, forces, one, response);
  other.load(cells, forces, two, response);
  EXPECT_EQ(contact.cell_displacements(), other.cell_displacements());
  contact.solve(cells, one, response);
  other.solve(cells, two, response);
  EXPECT_EQ(one.forces, two.forces);
  EXPECT_EQ(one.lifted, two.lifted);
  EXPECT_EQ(saved(contact), saved(other));
}

TEST(TissueContactStateOf, AnUpdateThatIsGivenBackFirstStays) {
  auto body = ChangedBody::prepare(
      [] {
        NodedBody cube = jittered_cube(6, 0.2);
        for (Vec3& x : cube.surface.vertices) x *= 0.04;
        for (Vec3& x : cube.cloud.positions) x *= 0.04;
        for (double& h : cube.cloud.spacings) h *= 0.04;
        return cube;
      }(),
      kTissue, [](const Vec3& x) { return x.z() < -0.02 + 1e-9; },
      [](const Vec3& x) { return x.z() > 0.02 - 1e-9; }, [](const Vec3& x) { return x.z() > 0.0; });
  ASSERT_TRUE(body);
  const Vec3 pole(2e-3, -1e-3, 0.02);
  const auto inside = [&](const Vec3& x) { return (x - pole).norm() < 7e-3; };
  const auto update = std::make_shared<const StiffnessUpdate>(update_stiffness(
      (*body)->changeable(), {(*body)->factors(4.0, inside), {}}, (*body)->touchable()));
  auto spring = test::plane_cells(pole + Vec3(6e-3, 0, 0), 1e-3, 0, 0.0, 0.0);
  spring[0].held = true;
  const auto cells_at = [&](int i) {
    auto cells = test::plane_cells(pole, 0.7e-3, 2, 0.0, 0.5e-3 + 1e-6 * i);
    cells.push_back(spring[0]);
    return cells;
  };
  ContactSolution solution;
  ContactResponse response;
  std::vector<float> places;
  const auto frame = [&](PatchContact& contact, int i) {
    contact.solve(cells_at(i), solution, response);
    contact.place_displacements(places);
    Hasher hasher;
    write(hasher, contact.state());
    write(hasher, solution.forces);
    write(hasher, response);
    write(hasher, places);
    return hasher.hex();
  };
  PatchContact first((*body)->sound(), (*body)->touchable(), kTissue);
  first.anchor(spring);
  for (int i = 0; i < 6; ++i) frame(first, i);
  first.stiffen(update);
  // Before anything is solved again, and while columns are put together.
  for (const int begin : {6, 12}) {
    for (int i = 6; i < begin; ++i) frame(first, i);
    PatchContact other((*body)->sound(), (*body)->touchable(), kTissue);
    other.anchor(spring);
    other.stiffen(update);
    give(saved(first), other);
    for (int i = begin; i < begin + 6; ++i) ASSERT_EQ(frame(other, i), frame(first, i)) << i;
    give(saved(other), first);
  }
}

TEST(TissueContactStateOf, WhatCannotBeItsOwnIsRefused) {
  Press press(3);
  for (int i = 0; i < 20; ++i) press.frame(i);
  const PatchContact& contact = press.contact;
  ASSERT_EQ(contact.state().forces.size(), 22u);
  const auto fits_with = [&](const auto& change) {
    PatchContact::State state = contact.state();
    change(state);
    return contact.fits(state);
  };
  using State = PatchContact::State;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(fits_with([](State&) {}));
  EXPECT_TRUE(contact.fits({}));
  EXPECT_FALSE(fits_with([](State& s) { s.places[2].area = 0.0; }));
  EXPECT_FALSE(fits_with([](State& s) { s.places[2].position.x() = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.ways.pop_back(); }));
  EXPECT_FALSE(fits_with([](State& s) { s.ways[0].friction = -1.0; }));
  EXPECT_FALSE(fits_with([](State& s) { s.amounts[0] = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.lifted = MatrixX::Identity(2, 2); }));
  EXPECT_FALSE(fits_with([](State& s) { s.forces.pop_back(); }));
  EXPECT_FALSE(fits_with([](State& s) { s.response.loads.pop_back(); }));
  EXPECT_FALSE(fits_with([](State& s) { s.response.touched[0] = -1; }));
  EXPECT_FALSE(fits_with([](State& s) { s.response.touched.back() = 1 << 20; }));
  EXPECT_FALSE(
      fits_with([](State& s) { std::swap(s.response.touched[0], s.response.touched[1]); }));
  // Anchors have columns of their own.
  EXPECT_FALSE(fits_with([](State& s) { s.columns_built = s.places.size(); }));
  EXPECT_FALSE(fits_with([](State& s) { s.stayed = -1; }));

  const std::vector<std::byte> bytes = saved(contact);
  for (std::size_t size = 0; size < bytes.size(); size += 97) {
    ByteReader reader(std::span<const std::byte>(bytes).first(size));
    State state;
    read(reader, state);
    EXPECT_TRUE(reader.failed()) << size;
  }
}

}  // namespace
}  // namespace viscera
