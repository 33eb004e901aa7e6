// What the keys of features say of an organ, an instrument or a scene, by type.
#pragma once

#include <any>
#include <map>
#include <typeindex>
#include <utility>

namespace viscera {

class Extras {
 public:
  template <class T>
  void set(T value) {
    values_[typeid(T)] = std::move(value);
  }
  /// Null where no key said anything of that kind.
  template <class T>
  const T* find() const {
    const auto found = values_.find(typeid(T));
    return found == values_.end() ? nullptr : std::any_cast<T>(&found->second);
  }
  template <class T>
  T* find() {
    return const_cast<T*>(std::as_const(*this).find<T>());
  }
  /// Made by default where there is none.
  template <class T>
  T& get() {
    if (!find<T>()) set(T());
    return *find<T>();
  }
  template <class T>
  void remove() {
    values_.erase(typeid(T));
  }

 private:
  std::map<std::type_index, std::any> values_;
};

}  // namespace viscera
