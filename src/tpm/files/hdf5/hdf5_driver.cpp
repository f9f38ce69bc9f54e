#include "tpm/files/hdf5/hdf5_driver.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_parts.hpp"

namespace tpm::files {
namespace {

/// HDF5 allocates none of these itself; it takes the address of `base`.
struct OpenStorage {
  H5FD_t base{};
  Hdf5Storage* storage = nullptr;
  haddr_t end_of_addresses = 0;
  haddr_t end_of_file = 0;
};

/// Storage that a file access list carries from open_hdf5() to the driver.
struct StorageChoice {
  Hdf5Storage* storage;
};

constexpr const char* kOnlyName = "tpm storage";

OpenStorage& of(H5FD_t* file) {
  return *reinterpret_cast<OpenStorage*>(file);
}
const OpenStorage& of(const H5FD_t* file) {
  return *reinterpret_cast<const OpenStorage*>(file);
}

H5FD_t* open_storage(const char* name, unsigned /*flags*/, hid_t access, haddr_t /*most*/) {
  const auto* choice = static_cast<const StorageChoice*>(H5Pget_driver_info(access));
  // An external link comes here with the name of its file.
  if (choice == nullptr || std::strcmp(name, kOnlyName) != 0) return nullptr;
  struct stat found {};
  if (::fstat(choice->storage->descriptor, &found) != 0) return nullptr;
  auto opened = std::make_unique<OpenStorage>();
  opened->storage = choice->storage;
  opened->end_of_file = choice->storage->writes ? 0 : static_cast<haddr_t>(found.st_size);
  return &opened.release()->base;
}

herr_t close_storage(H5FD_t* file) {
  const std::unique_ptr<OpenStorage> opened(&of(file));
  opened->storage->begin_of_free = opened->end_of_addresses;
  return 0;
}

int compare_storages(const H5FD_t* a, const H5FD_t* b) {
  const auto left = reinterpret_cast<std::uintptr_t>(of(a).storage);
  const auto right = reinterpret_cast<std::uintptr_t>(of(b).storage);
  return left < right ? -1 : static_cast<int>(left > right);
}

/// The same as those of HDF5's own driver for files.
herr_t features_of_storage(const H5FD_t* /*file*/, unsigned long* flags) {
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
           H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  return 0;
}

haddr_t end_of_addresses(const H5FD_t* file, H5FD_mem_t /*type*/) {
  return of(file).end_of_addresses;
}

herr_t set_end_of_addresses(H5FD_t* file, H5FD_mem_t /*type*/, haddr_t end) {
  of(file).end_of_addresses = end;
  return 0;
}

haddr_t end_of_storage(const H5FD_t* file, H5FD_mem_t /*type*/) {
  return of(file).end_of_file;
}

/// Lays bytes that could not be written over those that were read.
void lay_over(const Hdf5Storage& storage, haddr_t from, std::size_t size, char* bytes) {
  for (const auto& [place, kept] : storage.unwritten) {
    const std::uint64_t first = std::max<std::uint64_t>(place, from);
    const std::uint64_t last = std::min<std::uint64_t>(place + kept.size(), from + size);
    if (first < last) std::memcpy(bytes + (first - from), &kept[first - place], last - first);
  }
}

herr_t read_storage(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t from,
                    std::size_t size, void* to) {
  const OpenStorage& opened = of(file);
  auto* bytes = static_cast<char*>(to);
  const auto done = pread_all(opened.storage->descriptor, bytes, size, from);
  if (!done) return -1;
  std::memset(bytes + *done, 0, size - *done);  // behind the end, as HDF5's own driver does
  lay_over(*opened.storage, from, size, bytes);
  return 0;
}

herr_t write_storage(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t to,
                     std::size_t size, const void* from) {
  OpenStorage& opened = of(file);
  Hdf5Storage& storage = *opened.storage;
  if (!storage.writes) return -1;
  const auto* bytes = static_cast<const char*>(from);
  opened.end_of_file = std::max<haddr_t>(opened.end_of_file, to + size);
  std::size_t done = 0;
  if (storage.error_number == 0) {
    done = pwrite_all(storage.descriptor, bytes, size, to);
    if (done < size) storage.error_number = errno;
  }
  if (done < size) {
    auto& kept = storage.unwritten[to + done];
    if (kept.size() < size - done) kept.resize(size - done);
    std::copy(bytes + done, bytes + size, kept.begin());
  }
  return 0;
}

herr_t truncate_storage(H5FD_t* file, hid_t /*transfer*/, hbool_t /*closing*/) {
  OpenStorage& opened = of(file);
  opened.end_of_file = opened.end_of_addresses;  // the writer cuts the file itself
  return 0;
}

H5FD_class_t storage_class() {
  H5FD_class_t driver{};
#ifdef H5FD_CLASS_VERSION
  driver.version = H5FD_CLASS_VERSION;
  driver.value = static_cast<H5FD_class_value_t>(H5_VFD_RESERVED + 1);
#endif
  driver.name = "tpm_storage";
  driver.maxaddr = (haddr_t{1} << 62U);
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.fapl_size = sizeof(StorageChoice);
  driver.open = open_storage;
  driver.close = close_storage;
  driver.cmp = compare_storages;
  driver.query = features_of_storage;
  driver.get_eoa = end_of_addresses;
  driver.set_eoa = set_end_of_addresses;
  driver.get_eof = end_of_storage;
  driver.read = read_storage;
  driver.write = write_storage;
  driver.truncate = truncate_storage;
  const H5FD_mem_t map[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
  std::copy(std::begin(map), std::end(map), std::begin(driver.fl_map));
  return driver;
}

Hdf5Handle access_to(Hdf5Storage& storage) {
  static const H5FD_class_t driver = storage_class();
  static const hid_t number = H5FDregister(&driver);
  Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  const StorageChoice choice{&storage};
  if (H5Pset_driver(access.get(), number, &choice) < 0) access.reset();
  return access;
}

}  // namespace

Hdf5Handle create_hdf5(Hdf5Storage& storage) {
  storage.writes = true;
  const Hdf5Handle access = access_to(storage);
  return {H5Fcreate(kOnlyName, H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose};
}

Hdf5Handle open_hdf5(Hdf5Storage& storage) {
  const Hdf5Handle access = access_to(storage);
  return {H5Fopen(kOnlyName, H5F_ACC_RDONLY, access.get()), H5Fclose};
}

}  // namespace tpm::files
