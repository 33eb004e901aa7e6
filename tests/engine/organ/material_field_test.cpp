// Moduli and densities by place, as the parts of an organ say them.
#include "engine/organ/material_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/label_files.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kRadius = 20e-3;  // of the organ [m]

Tissue tissue() {
  Tissue soft;
  soft.elastic = {10e3, 0.45};
  soft.density = 1000.0;
  return soft;
}

TriangleSurface ball() {
  return icosphere(kRadius, 4);
}

PartDescription part(auto where, std::optional<double> modulus,
                     std::optional<double> density = {}) {
  return {std::move(where), modulus, density};
}

Region ball_at(const Vec3& centre, double radius) {
  Region region;
  region.shape = Region::Shape::kSphere;
  region.a = centre;
  region.radius = radius;
  return region;
}

std::shared_ptr<const MaterialField> field_of(std::vector<PartDescription> parts) {
  OrganDescription organ;
  organ.parts = std::move(parts);
  auto field = MaterialField::make(organ, tissue(), ball(), project_file("assets"));
  EXPECT_TRUE(field) << field.error().text();
  return field ? *field : nullptr;
}

std::string refusal(std::vector<PartDescription> parts) {
  OrganDescription organ;
  organ.parts = std::move(parts);
  const auto field = MaterialField::make(organ, tissue(), ball(), project_file("assets"));
  EXPECT_FALSE(field);
  return field ? "" : field.error().text();
}

PointCloud nodes() {
  PointCloud cloud;
  for (double x = -kRadius; x <= kRadius; x += 4e-3)
    for (double y = -kRadius; y <= kRadius; y += 4e-3)
      for (double z = -kRadius; z <= kRadius; z += 4e-3)
        if (Vec3(x, y, z).norm() < kRadius) {
          cloud.positions.emplace_back(x, y, z);
          cloud.spacings.push_back(4e-3);
        }
  return cloud;
}

/// Of a number over cubes of this edge that fill a box about the origin [m3].
double integral(const std::function<double(const Vec3&, double)>& of, double edge) {
  double sum = 0.0;
  const int count = static_cast<int>(std::ceil(kRadius / edge)) + 1;
  for (int i = -count; i <= count; ++i)
    for (int j = -count; j <= count; ++j)
      for (int k = -count; k <= count; ++k)
        sum += std::pow(edge, 3) * of(edge * Vec3(i, j, k), edge);
  return sum;
}

TEST(MaterialField, AnOrganWithoutPartsHasNone) {
  EXPECT_EQ(field_of({}), nullptr);
}

TEST(MaterialField, ABallFillsItsVolumeOfCubesOfAnyWidth) {
  const auto field = field_of({part(ball_at(Vec3(1e-3, 2e-3, 0), 7e-3), 20e3)});
  const double exact = 4.0 / 3.0 * std::numbers::pi * std::pow(7e-3, 3);
  for (const double edge : {1e-3, 3e-3, 6e-3})
    EXPECT_NEAR(integral([&](const Vec3& x, double e) { return field->modulus(x, e) - 1.0; }, edge),
                exact, 0.02 * exact)
        << edge;
}

TEST(MaterialField, LaterPartsLieOverEarlierOnesAndDensityIsOnItsOwn) {
  const auto field = field_of(
      {part(ball_at(Vec3::Zero(), 10e-3), 50e3, 1200.0), part(ball_at(Vec3::Zero(), 4e-3), 2e3)});
  EXPECT_NEAR(field->modulus(Vec3::Zero(), 1e-3), 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(field->modulus(Vec3(7e-3, 0, 0), 1e-3), 5.0);
  EXPECT_DOUBLE_EQ(field->modulus(Vec3(15e-3, 0, 0), 1e-3), 1.0);
  EXPECT_DOUBLE_EQ(field->density(Vec3::Zero(), 1e-3), 1.2);
  EXPECT_DOUBLE_EQ(field->density(Vec3(15e-3, 0, 0), 1e-3), 1.0);
}

TEST(MaterialField, ACapsuleCountsByItsShareOfWhatTheSurfaceLeavesOfACell) {
  const auto field = field_of({part(CapsulePart{0.5e-3}, 110e3)});
  // Cells of 4 mm: a slab of 2 mm cut off by the surface, a whole one below it.
  EXPECT_NEAR(field->modulus(Vec3(0, 0, kRadius - 1e-3), 4e-3), 1.0 + 10.0 * 0.25, 0.02);
  EXPECT_NEAR(field->modulus(Vec3(0, 0, kRadius - 2e-3), 4e-3), 1.0 + 10.0 * 0.125, 0.02);
  EXPECT_DOUBLE_EQ(field->modulus(Vec3(0, 0, kRadius - 4e-3), 4e-3), 1.0);
}

TEST(MaterialField, ARecipeIsABodyInTheOrgansFrame) {
  const auto field = field_of({part(RecipePart{"gallbladder", 1}, 30e3)});
  const double volume =
      integral([&](const Vec3& x, double e) { return 0.5 * (field->modulus(x, e) - 1.0); }, 1e-3);
  EXPECT_GT(volume, 1e-7);
}

class MappedField : public testing::Test {
 protected:
  std::filesystem::path write(const LabelImage& image) {
    write_bytes(folder_ / "map.nii", nifti_bytes(image, {.type = NiftiType::kInt32}));
    return folder_ / "map.nii";
  }
  TemporaryFolder folder_;
};

TEST_F(MappedField, ALabelFillsItsVoxels) {
  LabelImage image = centred_image({50, 50, 50}, {1, 1, 1});
  image.fill(3, [](const Vec3& x) { return (x - Vec3(2, 0, 0)).norm() < 6.0; });
  const auto voxels = std::count(image.labels.begin(), image.labels.end(), 3);
  const auto field = field_of({part(LabelPart{write(image), 3}, 20e3)});
  const double exact = 1e-9 * static_cast<double>(voxels);
  for (const double edge : {1.5e-3, 4e-3})
    EXPECT_NEAR(integral([&](const Vec3& x, double e) { return field->modulus(x, e) - 1.0; }, edge),
                exact, 0.02 * exact);
  EXPECT_THAT(refusal({part(LabelPart{write(image), 4}, 20e3)}),
              HasSubstr("parts/0: labels/label: found no voxel of label 4"));
}

TEST_F(MappedField, AMapOfModuliIsReadInItsUnit) {
  // 5 kPa on one side, 25 kPa on the other, in pascals: more values than a label map may have.
  LabelImage image = centred_image({50, 50, 50}, {1, 1, 1});
  for (int k = 0; k < 50; ++k)
    for (int j = 0; j < 50; ++j)
      for (int i = 0; i < 50; ++i)
        image.at(i, j, k) = (image.centre(i, j, k).x() > 0.0 ? 25000 : 5000) + (i + 50 * j) % 7;
  const auto field = field_of({part(ModulusMapPart{write(image), 1.0}, {})});
  // A map runs to the patient's right, a scene's frame to the left.
  EXPECT_NEAR(field->modulus(Vec3(-10e-3, 0, 0), 1e-3), 2.5, 1e-3);
  EXPECT_NEAR(field->modulus(Vec3(10e-3, 0, 0), 1e-3), 0.5, 1e-3);
  EXPECT_TRUE(field->check(nodes()));
}

TEST_F(MappedField, BackgroundBesideTheOrganDoesNotSoftenItsSurface) {
  LabelImage image = centred_image({60, 60, 60}, {1, 1, 1});
  image.fill(20, [](const Vec3& x) { return x.norm() < 20.0; });
  const auto field = field_of({part(ModulusMapPart{write(image), 1e3}, {})});
  EXPECT_NEAR(field->modulus(Vec3(0, 0, kRadius - 0.2e-3), 2e-3), 2.0, 1e-9);
}

TEST_F(MappedField, AMapThatDoesNotCoverTheOrganIsRefusedWithThePlace) {
  LabelImage small = centred_image({30, 50, 50}, {1, 1, 1});
  std::fill(small.labels.begin(), small.labels.end(), 8);
  EXPECT_THAT(refusal({part(ModulusMapPart{write(small), 1e3}, {})}),
              HasSubstr("parts/0: field: found no modulus at ("));
  LabelImage hollow = centred_image({50, 50, 50}, {1, 1, 1});
  hollow.fill(8, [](const Vec3& x) { return x.norm() > 12.0; });
  const auto field = field_of({part(ModulusMapPart{write(hollow), 1e3}, {})});
  const auto checked = field->check(nodes());
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().text(),
              AllOf(HasSubstr("found no modulus at ("), HasSubstr("in the organ")));
  LabelImage negative = centred_image({50, 50, 50}, {1, 1, 1});
  negative.labels.assign(negative.labels.size(), -3);
  EXPECT_THAT(refusal({part(ModulusMapPart{write(negative), 1e3}, {})}),
              HasSubstr("expected none below 0"));
}

TEST(MaterialField, APartThatLiesNowhereInTheOrganIsRefused) {
  const auto field = field_of(
      {part(ball_at(Vec3::Zero(), 2e-3), 20e3), part(ball_at(Vec3(60e-3, 0, 0), 5e-3), 20e3)});
  const auto checked = field->check(nodes());
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().text(), HasSubstr("parts/1: found nothing of it in the organ"));
}

PartDescription woven(auto where, const Vec3& direction, double modulus) {
  return {std::move(where), std::nullopt, std::nullopt, Fibres{direction.normalized(), modulus}};
}

TEST(MaterialField, FibresOfAPartLieOverThoseOfTheTissue) {
  Tissue muscle = tissue();
  muscle.fibres = {Vec3::UnitX(), 30e3};
  OrganDescription organ;
  organ.parts = {woven(ball_at(Vec3::Zero(), 10e-3), Vec3(0.0, 1.0, 1.0), 50e3),
                 woven(ball_at(Vec3::Zero(), 5e-3), Vec3::UnitX(), 0.0)};
  const auto field = MaterialField::make(organ, muscle, ball(), project_file("assets"));
  ASSERT_TRUE(field) << field.error().text();
  EXPECT_TRUE((*field)->has_fibres());
  EXPECT_EQ((*field)->fibres({15e-3, 0, 0}, 1e-3), muscle.fibres);
  EXPECT_EQ((*field)->fibres({7.5e-3, 0, 0}, 1e-3), *organ.parts[0].fibres);
  EXPECT_EQ((*field)->fibres(Vec3::Zero(), 1e-3).modulus, 0.0);
}

TEST(MaterialField, WhereFamiliesMeetTheStrongerOneSaysTheDirection) {
  Tissue muscle = tissue();
  muscle.fibres = {Vec3::UnitX(), 30e3};
  OrganDescription organ;
  organ.parts = {woven(ball_at(Vec3::Zero(), 10e-3), Vec3::UnitY(), 10e3)};
  const auto field = MaterialField::make(organ, muscle, ball(), project_file("assets"));
  ASSERT_TRUE(field) << field.error().text();
  const Fibres border = (*field)->fibres({10e-3, 0, 0}, 2e-3);
  EXPECT_NEAR(std::abs(border.direction.x()), 1.0, 1e-9);
  EXPECT_NEAR(border.modulus, 15e3, 1e3);
}

}  // namespace
}  // namespace viscera::test
