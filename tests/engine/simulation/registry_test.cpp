#include "engine/simulation/registry.h"

#include <gtest/gtest.h>

#include <string>

namespace viscera {
namespace {

TEST(Registry, AStaleNameFindsNothing) {
  EntityIds ids;
  Pool<std::string> names;
  const Entity first = ids.create();
  names.add(first, "first");
  names.remove(first);
  ids.destroy(first);
  const Entity second = ids.create();
  EXPECT_EQ(second.index, first.index);
  names.add(second, "second");
  EXPECT_FALSE(ids.alive(first));
  EXPECT_EQ(names.find(first), nullptr);
  ASSERT_NE(names.find(second), nullptr);
  EXPECT_EQ(*names.find(second), "second");
}

TEST(Registry, RemovingKeepsTheOrderOfTheOthers) {
  EntityIds ids;
  Pool<int> values;
  std::vector<Entity> entities;
  for (int i = 0; i < 5; ++i) {
    entities.push_back(ids.create());
    values.add(entities.back(), i);
  }
  values.remove(entities[1]);
  std::vector<int> left(values.begin(), values.end());
  EXPECT_EQ(left, (std::vector<int>{0, 2, 3, 4}));
  EXPECT_EQ(*values.find(entities[4]), 4);
  EXPECT_EQ(values.owner(1), entities[2]);
}

TEST(Registry, AnEntityWithoutTheComponentHasNone) {
  EntityIds ids;
  Pool<int> values;
  const Entity without = ids.create();
  EXPECT_EQ(values.find(without), nullptr);
  values.remove(without);
  EXPECT_EQ(values.size(), 0u);
}

}  // namespace
}  // namespace viscera
