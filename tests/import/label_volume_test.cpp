// One phantom in every format gives the same voxels in the same places; broken and hostile files are refused with what was expected.
#include "phantoms.hpp"

#include "engine/io/label_volume.hpp"
#include "engine/importing/label_mask.hpp"

using namespace trocar;
using namespace trocar::engine;
using namespace trocar::import_test;

namespace {

Phantom small_phantom(std::uint64_t seed) {
    Dice dice(seed);
    const Vec3 spacing(dice.between(0.3, 1.2), dice.between(0.3, 1.2), dice.between(0.3, 2.0));
    Phantom phantom{{7, 5, 6}, spacing, Vec3(dice.between(-90, 90), dice.between(-90, 90), dice.between(-90, 90)), dice.turn(), std::string(210, '\0')};
    for (char& voxel : phantom.voxels) voxel = static_cast<char>(dice.between(0, 3));
    return phantom;
}

void expect_same(const LabelVolume& volume, const Phantom& phantom, double tolerance_mm) {
    ASSERT_EQ(volume.size, phantom.size);
    for (std::size_t k = 0; k < phantom.size[2]; ++k)
        for (std::size_t j = 0; j < phantom.size[1]; ++j)
            for (std::size_t i = 0; i < phantom.size[0]; ++i) {
                const std::size_t v = phantom.at(i, j, k);
                ASSERT_EQ(volume.label(v), phantom.voxels[v]);
                const Vec3 place = volume.origin + volume.axes * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
                ASSERT_LT((1e3 * place - to_ras(phantom.place(i, j, k))).norm(), tolerance_mm);
            }
}

/// Refused, and the message says all of it.
void expect_refused(const Result<LabelVolume>& read, std::initializer_list<const char*> says) {
    ASSERT_FALSE(read.ok());
    for (const char* each : says) EXPECT_NE(read.error().to_string().find(each), std::string::npos) << each << "\n" << read.error().to_string();
}

using LabelFiles = Folder;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    return at == text.npos ? text : text.replace(at, from.size(), to);
}

} // namespace

TEST_F(LabelFiles, OfEveryFormatHoldTheSameVoxelsInTheSamePlaces) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const Phantom p = small_phantom(seed);
        std::string ascii = nrrd_header(p, "ascii");
        for (const char voxel : p.voxels) ascii += fmt::format("{} ", static_cast<int>(voxel));
        write("beside.raw", p.voxels);
        write("beside.zraw", gzip_bytes(p.voxels).value());
        const std::pair<fs::path, double> files[] = {
            {write("a.nrrd", nrrd_raw(p)), 1e-9},
            {write("b.nrrd", nrrd_gzip(p)), 1e-9},
            {write("c.nrrd", ascii), 1e-9},
            {write("d.nhdr", nrrd_header(p, "raw", "data file: beside.raw\n")), 1e-9},
            {write("e.nii", nifti(p)), 1e-4},
            {write("f.nii.gz", gzip_bytes(nifti(p)).value()), 1e-4},
            {write("g.mha", metaimage_header(p, "LOCAL") + p.voxels), 1e-9},
            {write("h.mhd", metaimage_header(p, "beside.raw")), 1e-9},
            {write("i.mhd", metaimage_header(p, "beside.zraw", "CompressedData = True\n")), 1e-9},
        };
        for (const auto& [file, tolerance] : files) {
            SCOPED_TRACE(file.filename().string());
            const Result<LabelVolume> volume = read_label_volume(file);
            ASSERT_TRUE(volume.ok()) << volume.error().to_string();
            expect_same(*volume, p, tolerance);
        }
    }
}

TEST_F(LabelFiles, OfRightAnteriorSuperiorLieWhereTheirLeftPosteriorTwinsLie) {
    const Phantom p = small_phantom(5);
    Phantom ras = p;
    const Mat3 flip = Vec3(-1, -1, 1).asDiagonal();
    ras.turn = flip * p.turn;
    ras.origin = flip * p.origin;
    const std::string text = replaced(nrrd_header(ras, "raw"), "left-posterior-superior", "right-anterior-superior") + p.voxels;
    const Result<LabelVolume> volume = read_label_volume(write("ras.nrrd", text));
    ASSERT_TRUE(volume.ok()) << volume.error().to_string();
    expect_same(*volume, p, 1e-9);
}

TEST_F(LabelFiles, OfSlicerHaveNamedSegmentsInLayers) {
    Phantom p = small_phantom(3);
    std::string voxels; // two layers, the list axis first
    for (const char voxel : p.voxels) voxels += {voxel > 0 ? '\1' : '\0', voxel > 1 ? '\1' : '\0'};
    std::string header = nrrd_header(p, "raw",
                                     "Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\nSegment1_Name:=hepatic artery\n"
                                     "Segment1_LabelValue:=1\nSegment1_Layer:=1\n");
    header = replaced(header, "dimension: 3", "dimension: 4");
    header = replaced(header, "sizes: ", "sizes: 2 ");
    header = replaced(header, "space directions: ", "space directions: none ");
    header = replaced(header, "kinds: ", "kinds: list ");
    const Result<LabelVolume> volume = read_label_volume(write("two.seg.nrrd", header + voxels));
    ASSERT_TRUE(volume.ok()) << volume.error().to_string();
    ASSERT_EQ(volume->segments.size(), 2u);
    const auto count = [&](int least) { return static_cast<std::size_t>(std::count_if(p.voxels.begin(), p.voxels.end(), [&](char v) { return v >= least; })); };
    std::size_t first = 0, second = 0;
    for (std::size_t v = 0; v < volume->voxel_count(); ++v) first += volume->label(v, 0) == 1, second += volume->label(v, 1) == 1;
    EXPECT_EQ(first, count(1));
    EXPECT_EQ(second, count(2));
    const Result<LabelMask> none = make_mask(*volume, "");
    ASSERT_FALSE(none.ok());
    EXPECT_NE(none.error().to_string().find("--label: there are 2 segments; expected one of liver (1), hepatic artery (1)"), std::string::npos)
        << none.error().to_string();
    EXPECT_TRUE(make_mask(*volume, "hepatic artery").ok());
    EXPECT_FALSE(make_mask(*volume, "1").ok()) << "a number of both layers";
    EXPECT_FALSE(make_mask(*volume, "spleen").ok());
}

TEST_F(LabelFiles, ThatAreHostileAreRefusedWithWhatWasExpected) {
    const Phantom p = small_phantom(1);
    const std::string good = nrrd_raw(p), header = nrrd_header(p, "raw");
    int number = 0;
    const auto read = [&](const std::string& bytes, const char* ending = ".nrrd") { return read_label_volume(write(fmt::format("x{}{}", ++number, ending), bytes)); };
    expect_refused(read(good.substr(0, good.size() - 1)), {"ends after 209 bytes of data; the header announces 210"});
    expect_refused(read(replaced(good, "sizes: 7 5 6", "sizes: 1000000000000 5 6")), {"sizes", "1073741824 bytes that are read"});
    expect_refused(read(replaced(good, "sizes: 7 5 6", "sizes: 4294967296 4294967296 4294967296")), {"sizes", "bytes that are read"});
    expect_refused(read(replaced(good, "sizes: 7 5 6", "sizes: 0 5 6")), {"sizes", "at least one voxel"});
    expect_refused(read(replaced(good, "sizes: 7 5 6", "sizes: -7 5 6")), {"sizes", "3 integers"});
    expect_refused(read(replaced(good, "sizes: 7 5 6", "sizes: 7 5")), {"sizes", "3 integers"});
    expect_refused(read(replaced(good, "type: unsigned char", "type: block")), {"type", "found 'block'"});
    expect_refused(read(replaced(good, "type: unsigned char", "type: short")), {"endian", "little or big"});
    expect_refused(read(replaced(good, "encoding: raw", "encoding: bzip2")), {"encoding", "raw, gzip or ascii"});
    expect_refused(read(replaced(good, "encoding: raw", "encoding: gzip")), {"compressed data"});
    expect_refused(read(replaced(good, "space: left-posterior-superior", "space: scanner-xyz")), {"space", "found 'scanner-xyz'"});
    expect_refused(read(replaced(good, "type: unsigned char", "type: unsigned char\ntype: short")), {"'type' stands twice"});
    expect_refused(read(replaced(good, "NRRD0004", "PNG")), {"magic"});
    expect_refused(read(good.substr(0, good.find("dimension"))), {"ends within its header"});
    expect_refused(read(""), {"is empty"});
    for (const char* vector : {"(nan,0,0)", "(0,0,0)", "(inf,0,0)", "(1,0)", "(1e9,0,0)", "1 0 0", "none"}) {
        Phantom plain = p;
        plain.turn = Mat3::Identity();
        const std::string first = vector_text(plain.axes().col(0));
        expect_refused(read(replaced(nrrd_raw(plain), first, vector)), {"space directions"});
    }
    {
        Phantom plain = p;
        plain.turn = Mat3::Identity();
        const Vec3 sheared = plain.axes().col(0) + 0.05 * plain.axes().col(1);
        expect_refused(read(replaced(nrrd_raw(plain), vector_text(plain.axes().col(0)), vector_text(sheared))), {"not perpendicular", "resample"});
    }
    const std::string nii = nifti(p);
    const auto with = [](std::string bytes, std::size_t at, auto value) {
        put(bytes, at, value);
        return bytes;
    };
    expect_refused(read(nii.substr(0, nii.size() - 1), ".nii"), {"ends after 561 bytes", "352 to 562"});
    expect_refused(read(nii.substr(0, 100), ".nii"), {"ends after 100 bytes; a NIfTI-1 header has 348"});
    expect_refused(read(with(nii, 0, std::int32_t{540}), ".nii"), {"NIfTI-2"});
    expect_refused(read(with(nii, 0, std::int32_t{7}), ".nii"), {"no NIfTI-1 file"});
    expect_refused(read(with(nii, 42, std::int16_t{-3}), ".nii"), {"byte 42", "found -3"});
    expect_refused(read(with(nii, 70, std::int16_t{128}), ".nii"), {"byte 70", "datatype"});
    expect_refused(read(with(nii, 72, std::int16_t{16}), ".nii"), {"byte 72", "bitpix"});
    expect_refused(read(with(nii, 108, std::numeric_limits<float>::quiet_NaN()), ".nii"), {"byte 108", "vox_offset"});
    expect_refused(read(with(nii, 280, std::numeric_limits<float>::quiet_NaN()), ".nii"), {"srow"});
    expect_refused(read(with(nii, 280, 0.0F), ".nii"), {"srow"});
    const std::string mha = metaimage_header(p, "LOCAL") + p.voxels;
    expect_refused(read(mha.substr(0, mha.size() - 3), ".mha"), {"ends after 207 bytes of data; the header announces 210"});
    expect_refused(read(replaced(mha, "DimSize = 7 5 6", "DimSize = 70000 50000 60000"), ".mha"), {"DimSize", "bytes that are read"});
    expect_refused(read(replaced(mha, "NDims = 3", "NDims = 2"), ".mha"), {"NDims", "expected 3"});
    expect_refused(read(replaced(mha, "ElementSpacing = ", "ElementSpacing = nan "), ".mha"), {"ElementSpacing"});
    expect_refused(read(replaced(mha, "ElementType = MET_UCHAR", "ElementType = MET_OTHER"), ".mha"), {"ElementType", "MET_OTHER"});
    expect_refused(read("nothing of it", ".mha"), {"expected 'Key = value'"});
    expect_refused(read_label_volume(folder / "missing.nrrd"), {"cannot be opened"});
    expect_refused(read_label_volume(write("a.dcm", "x")), {"no format of label maps"});
}

TEST_F(LabelFiles, NameNoDataOutsideOfTheirFolder) {
    const Phantom p = small_phantom(2);
    write("secret.raw", p.voxels);
    for (const std::string& named : {std::string("../secret.raw"), (folder / "secret.raw").string(), std::string("down/../../secret.raw"), std::string("/etc/passwd")}) {
        SCOPED_TRACE(named);
        expect_refused(read_label_volume(write("inner/a.nhdr", nrrd_header(p, "raw", "data file: " + named + "\n"))), {"data file", "header's folder"});
        expect_refused(read_label_volume(write("inner/a.mhd", metaimage_header(p, named))), {"ElementDataFile", "header's folder"});
    }
    fs::create_directories(folder / "inner");
    fs::create_symlink(folder / "secret.raw", folder / "inner" / "link.raw");
    expect_refused(read_label_volume(write("inner/b.nhdr", nrrd_header(p, "raw", "data file: link.raw\n"))), {"a link leads out"});
    expect_refused(read_label_volume(write("inner/c.nhdr", nrrd_header(p, "raw", "data file: LIST\n"))), {"not a list"});
}

TEST_F(LabelFiles, ThatHoldMoreThanTheirHeaderAnnouncesAreRefusedUnlessItIsPadding) {
    const Phantom p = small_phantom(4);
    const auto file = [&](const std::string& name, const std::string& more) {
        const std::string voxels = p.voxels + more;
        if (name == "a.nrrd") return write(name, nrrd_header(p, "raw") + voxels);
        if (name == "b.nrrd") return write(name, nrrd_header(p, "gzip") + gzip_bytes(voxels).value());
        if (name == "c.mha") return write(name, metaimage_header(p, "LOCAL") + voxels);
        if (name == "d.nii") return write(name, nifti(p) + more);
        return write(name, gzip_bytes(nifti(p) + more).value());
    };
    const std::pair<const char*, const char*> files[] = {{"a.nrrd", "sizes"}, {"b.nrrd", "sizes"}, {"c.mha", "DimSize"}, {"d.nii", "dim"}, {"e.nii.gz", "dim"}};
    for (const auto& [name, key] : files) {
        SCOPED_TRACE(name);
        const Result<LabelVolume> padded = read_label_volume(file(name, std::string(512, '\1')));
        ASSERT_TRUE(padded.ok()) << padded.error().to_string();
        expect_same(*padded, p, 1e-4);
        ASSERT_FALSE(padded->notes.empty());
        EXPECT_EQ(padded->notes.back(), "512 bytes after the voxels are padding");
        expect_refused(read_label_volume(file(name, std::string(513, '\1'))), {key, "more than 512 bytes of data follow the 210 that the header announces"});
        expect_refused(read_label_volume(file(name, std::string(std::size_t{64} << 20, '\0'))), {key, "more than 512 bytes of data follow"}); // packed: a bomb
    }
    std::string text = nrrd_header(p, "ascii");
    for (std::size_t v = 0; v <= p.voxels.size(); ++v) text += "1 ";
    expect_refused(read_label_volume(write("f.nrrd", text)), {"sizes", "more numbers follow the 210"});
}

TEST_F(LabelFiles, OfTheOtherByteOrderAreRefusedUnlessALabelIsAskedFor) {
    const Phantom p = small_phantom(7);
    std::string voxels;
    for (const char voxel : p.voxels) voxels += {voxel, '\0'};
    const auto volume = [&](const char* endian) {
        std::string header = nrrd_header(p, "raw", fmt::format("endian: {}\n", endian));
        return read_label_volume(write("two.nrrd", replaced(header, "type: unsigned char", "type: ushort") + voxels));
    };
    const Result<LabelVolume> right = volume("little"), wrong = volume("big");
    ASSERT_TRUE(right.ok() && wrong.ok());
    EXPECT_TRUE(make_mask(*right, "1").ok());
    const Result<LabelMask> refused = make_mask(*wrong, "");
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().to_string().find("endian: all its labels are multiples of 256, the first is 256"), std::string::npos) << refused.error().to_string();
    EXPECT_TRUE(make_mask(*wrong, "256").ok()) << "as it is";
    const std::string meta = replaced(replaced(metaimage_header(p, "LOCAL"), "MET_UCHAR", "MET_USHORT"), "MSB = False", "MSB = True");
    const Result<LabelVolume> most_first = read_label_volume(write("two.mha", meta + voxels));
    ASSERT_TRUE(most_first.ok()) << most_first.error().to_string();
    EXPECT_EQ(make_mask(*most_first, "").error().key, "BinaryDataByteOrderMSB") << "as the file calls it";
}

TEST_F(LabelFiles, WithLayersButWithoutNamesTakeTheLayerAndTheNumber) {
    const Phantom p = small_phantom(8);
    std::string bytes = nifti(p) + p.voxels;
    put<std::int16_t>(bytes, 40, 4);
    put<std::int16_t>(bytes, 48, 2);
    const Result<LabelVolume> volume = read_label_volume(write("layers.nii", bytes));
    ASSERT_TRUE(volume.ok()) << volume.error().to_string();
    const Result<LabelMask> none = make_mask(*volume, "");
    ASSERT_FALSE(none.ok());
    EXPECT_NE(none.error().to_string().find("expected one of 0:1 (1), 0:2 (2), 1:1 (1), 1:2 (2)"), std::string::npos) << none.error().to_string();
    EXPECT_TRUE(make_mask(*volume, "1:2").ok());
}

TEST_F(LabelFiles, ThatAreCutAnywhereNeverCrash) {
    const Phantom p = small_phantom(6);
    const std::pair<std::string, const char*> files[] = {
        {nrrd_raw(p), ".nrrd"}, {nrrd_gzip(p), ".nrrd"}, {nifti(p), ".nii"}, {gzip_bytes(nifti(p)).value(), ".nii.gz"}, {metaimage_header(p, "LOCAL") + p.voxels, ".mha"}};
    Dice dice(9);
    for (const auto& [bytes, ending] : files)
        for (int trial = 0; trial < 60; ++trial) {
            const auto length = static_cast<std::size_t>(dice.between(0, static_cast<double>(bytes.size() - 1)));
            EXPECT_FALSE(read_label_volume(write(std::string("cut") + ending, bytes.substr(0, length))).ok() && length + 8 < bytes.size()) << ending << " " << length;
            std::string damaged = bytes;
            for (int hit = 0; hit < 3; ++hit) damaged[static_cast<std::size_t>(dice.between(0, static_cast<double>(bytes.size() - 1)))] = static_cast<char>(dice.between(0, 255));
            (void)read_label_volume(write(std::string("damaged") + ending, damaged)); // any answer but a crash
        }
}
