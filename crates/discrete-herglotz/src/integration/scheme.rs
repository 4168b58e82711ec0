//! The table of splitting schemes: coefficients, orders, sources.

// The coefficients have more digits than a double, so that they are correctly rounded.
#![allow(clippy::excessive_precision)]

use HalfSequence::{Composition, Nystrom};

/// A symmetric splitting of a flow into kicks and drifts: `kick k_0, drift d_1, kick k_1, ..., drift d_n, kick k_n`,
/// each a fraction of the step.
///
/// A composition is `S_(g_1 h) ... S_(g_s h)` of the Strang splitting, or of any symmetric map of order 2. A
/// Runge-Kutta-Nyström splitting satisfies fewer order conditions and has smaller errors, but its order holds only
/// where the commutator `[B, [B, [B, A]]]` vanishes: where the velocity enters A at most quadratically and B not at
/// all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplittingScheme {
    name: &'static str,
    order: u32,
    stages: usize,
    source: &'static str,
    coefficients: HalfSequence,
}

/// The first half of each symmetric sequence, including the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum HalfSequence {
    /// The substeps.
    Composition(&'static [f64]),
    /// Drifts and kicks, and whether the step begins and ends with a kick.
    Nystrom { kick_first: bool, drifts: &'static [f64], kicks: &'static [f64] },
}

const KAHAN_LI: &str = "Kahan and Li, Math. Comp. 66 (1997) 1089-1099, doi:10.1090/S0025-5718-97-00873-9";
const SOFRONIOU_SPALETTA: &str =
    "Sofroniou and Spaletta, Optim. Methods Softw. 20 (2005) 597-613, doi:10.1080/10556780500140664";
const BLANES_MOAN: &str =
    "Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313-330, table 3, doi:10.1016/S0377-0427(01)00492-7";

impl SplittingScheme {
    /// The Strang splitting, of order 2: Strang, SIAM J. Numer. Anal. 5 (1968) 506-517.
    pub const STRANG: Self = SplittingScheme {
        name: "strang",
        order: 2,
        stages: 1,
        source: "Strang, SIAM J. Numer. Anal. 5 (1968) 506-517, doi:10.1137/0705041",
        coefficients: Composition(&[1.0]),
    };

    /// The triple jump with `1/(2 - 2^(1/3))`, of order 4: Yoshida, Phys. Lett. A 150 (1990) 262-268.
    pub const YOSHIDA_4: Self = SplittingScheme {
        name: "yoshida_4",
        order: 4,
        stages: 3,
        source: "Yoshida, Phys. Lett. A 150 (1990) 262-268, doi:10.1016/0375-9601(90)90092-3",
        coefficients: Composition(&[1.351_207_191_959_657_8, -1.702_414_383_919_315_3]),
    };

    /// Suzuki's fractal composition with `1/(4 - 4^(1/3))`, of order 4: Phys. Lett. A 146 (1990) 319-323.
    pub const SUZUKI_4: Self = SplittingScheme {
        name: "suzuki_4",
        order: 4,
        stages: 5,
        source: "Suzuki, Phys. Lett. A 146 (1990) 319-323, doi:10.1016/0375-9601(90)90962-N",
        coefficients: Composition(&[0.414_490_771_794_375_74, 0.414_490_771_794_375_74, -0.657_963_087_177_502_9]),
    };

    /// Order 4 in five stages with a smaller error than the two above: McLachlan, SIAM J. Sci. Comput. 16 (1995)
    /// 151-168.
    pub const MCLACHLAN_4: Self = SplittingScheme {
        name: "mclachlan_4",
        order: 4,
        stages: 5,
        source: "McLachlan, SIAM J. Sci. Comput. 16 (1995) 151-168, doi:10.1137/0916010",
        coefficients: Composition(&[0.28, 0.625_466_428_467_670_045_01, -0.810_932_856_935_340_09]),
    };

    /// Order 6 in the least number of stages, seven: Yoshida's solution A, Phys. Lett. A 150 (1990) 262-268.
    pub const YOSHIDA_6: Self = SplittingScheme {
        name: "yoshida_6",
        order: 6,
        stages: 7,
        source: "Yoshida, Phys. Lett. A 150 (1990) 262-268, solution A, doi:10.1016/0375-9601(90)90092-3",
        coefficients: Composition(&[
            0.784_513_610_477_557_263_82,
            0.235_573_213_359_358_133_68,
            -1.177_679_984_178_871_006_95,
            1.315_186_320_683_911_218_88,
        ]),
    };

    /// Order 6 in nine stages: Kahan and Li, Math. Comp. 66 (1997) 1089-1099.
    pub const KAHAN_LI_6: Self = SplittingScheme {
        name: "kahan_li_6",
        order: 6,
        stages: 9,
        source: KAHAN_LI,
        coefficients: Composition(&[
            0.392_161_444_007_314_139_28,
            0.332_599_136_789_359_438_60,
            -0.706_246_172_557_639_359_81,
            0.082_213_596_293_550_800_23,
            0.798_543_990_934_829_963_40,
        ]),
    };

    /// Order 6 in thirteen stages: Sofroniou and Spaletta, Optim. Methods Softw. 20 (2005) 597-613.
    pub const SOFRONIOU_SPALETTA_6: Self = SplittingScheme {
        name: "sofroniou_spaletta_6",
        order: 6,
        stages: 13,
        source: SOFRONIOU_SPALETTA,
        coefficients: Composition(&[
            0.138_619_308_540_516_952_46,
            0.133_465_628_510_747_604_07,
            0.130_705_310_114_492_251_91,
            0.129_618_937_569_070_347_73,
            -0.350_003_248_939_208_965_16,
            0.118_055_306_530_023_871_70,
            0.399_077_515_348_715_874_60,
        ]),
    };

    /// Order 8 in the least number of stages, fifteen: Suzuki and Umeno, Springer Proc. Phys. 76 (1993) 74-86; the
    /// coefficients are those of McLachlan, SIAM J. Sci. Comput. 16 (1995) 151-168.
    pub const SUZUKI_UMENO_8: Self = SplittingScheme {
        name: "suzuki_umeno_8",
        order: 8,
        stages: 15,
        source: "Suzuki and Umeno, Springer Proc. Phys. 76 (1993) 74-86",
        coefficients: Composition(&[
            0.741_670_364_350_612_953_45,
            -0.409_100_825_800_031_594_00,
            0.190_754_710_296_238_379_95,
            -0.573_862_471_116_082_266_66,
            0.299_064_181_303_655_923_84,
            0.334_624_918_245_298_183_78,
            0.315_293_092_396_766_596_63,
            -0.796_887_939_352_916_354_02,
        ]),
    };

    /// Order 8 in seventeen stages: Kahan and Li, Math. Comp. 66 (1997) 1089-1099.
    pub const KAHAN_LI_8: Self = SplittingScheme {
        name: "kahan_li_8",
        order: 8,
        stages: 17,
        source: KAHAN_LI,
        coefficients: Composition(&[
            0.130_202_483_088_890_080_88,
            0.561_162_981_775_108_384_56,
            -0.389_474_962_644_847_286_41,
            0.158_841_906_555_155_600_90,
            -0.395_903_894_133_237_577_34,
            0.184_539_640_978_315_707_09,
            0.258_374_387_686_322_047_29,
            0.295_011_723_609_310_298_87,
            -0.605_508_533_830_034_511_70,
        ]),
    };

    /// Order 8 in twenty-one stages: Sofroniou and Spaletta, Optim. Methods Softw. 20 (2005) 597-613.
    pub const SOFRONIOU_SPALETTA_8: Self = SplittingScheme {
        name: "sofroniou_spaletta_8",
        order: 8,
        stages: 21,
        source: SOFRONIOU_SPALETTA,
        coefficients: Composition(&[
            0.106_477_289_845_500_318_24,
            0.108_374_086_458_357_263_97,
            0.353_378_210_526_543_424_20,
            -0.233_414_140_231_650_821_99,
            -0.244_452_667_915_288_412_69,
            0.113_178_484_357_556_333_15,
            0.118_929_056_250_003_500_63,
            0.126_039_123_218_259_881_40,
            0.125_817_187_361_760_418_04,
            0.116_991_350_192_176_421_81,
            -0.382_635_960_126_436_653_51,
        ]),
    };

    /// Order 10 in thirty-five stages: Sofroniou and Spaletta, Optim. Methods Softw. 20 (2005) 597-613.
    pub const SOFRONIOU_SPALETTA_10: Self = SplittingScheme {
        name: "sofroniou_spaletta_10",
        order: 10,
        stages: 35,
        source: SOFRONIOU_SPALETTA,
        coefficients: Composition(&[
            0.078_795_722_521_686_419_26,
            0.313_096_103_415_108_527_76,
            0.027_918_383_235_078_066_11,
            -0.229_592_841_593_907_094_15,
            0.130_962_061_077_164_863_17,
            -0.269_733_405_654_510_714_34,
            0.074_973_343_155_891_435_67,
            0.111_993_423_999_810_204_89,
            0.366_133_449_546_226_751_19,
            -0.399_105_630_136_035_897_88,
            0.103_087_398_527_471_077_32,
            0.411_430_873_955_890_237_82,
            -0.004_866_360_583_135_261_76,
            -0.392_033_353_708_639_906_45,
            0.051_942_502_962_449_647_04,
            0.050_665_090_759_924_496_34,
            0.049_674_370_639_729_879_05,
            0.049_317_735_759_594_537_92,
        ]),
    };

    /// The Runge-Kutta-Nyström splitting of order 4 in six stages, `SRKN_6^b`: Blanes and Moan, J. Comput. Appl. Math.
    /// 142 (2002) 313-330. The published fifteen digits are completed to the nearest solution of the order conditions.
    pub const BLANES_MOAN_4: Self = SplittingScheme {
        name: "blanes_moan_4",
        order: 4,
        stages: 6,
        source: BLANES_MOAN,
        coefficients: Nystrom {
            kick_first: true,
            drifts: &[0.245_298_957_184_271_123_45, 0.604_872_665_711_079_923_63, -0.350_171_622_895_351_047_07],
            kicks: &[
                0.082_984_406_417_404_982_34,
                0.396_309_801_498_368_061_85,
                -0.039_056_304_922_348_437_33,
                0.119_524_194_013_150_786_29,
            ],
        },
    };

    /// The Runge-Kutta-Nyström splitting of order 6 in eleven stages, `SRKN_11^b`: Blanes and Moan, J. Comput. Appl.
    /// Math. 142 (2002) 313-330. The published fifteen digits are completed to the nearest solution of the order
    /// conditions.
    pub const BLANES_MOAN_6: Self = SplittingScheme {
        name: "blanes_moan_6",
        order: 6,
        stages: 11,
        source: BLANES_MOAN,
        coefficients: Nystrom {
            kick_first: true,
            drifts: &[
                0.123_229_775_946_271_150_16,
                0.290_553_797_799_558_291_15,
                -0.127_049_212_625_416_997_26,
                -0.246_331_761_062_075_435_71,
                0.357_208_872_795_927_863_34,
                0.204_777_054_291_470_256_64,
            ],
            kicks: &[
                0.041_464_998_518_262_842_28,
                0.198_128_671_918_066_525_89,
                -0.040_006_192_104_152_692_78,
                0.075_253_984_301_580_309_45,
                -0.011_511_387_420_687_756_04,
                0.236_669_924_786_930_771_20,
            ],
        },
    };

    /// The Runge-Kutta-Nyström splitting of order 6 in fourteen stages, `SRKN_14^a`: Blanes and Moan, J. Comput. Appl.
    /// Math. 142 (2002) 313-330. The published fifteen digits are completed to the nearest solution of the order
    /// conditions.
    pub const BLANES_MOAN_6_LONG: Self = SplittingScheme {
        name: "blanes_moan_6_long",
        order: 6,
        stages: 14,
        source: BLANES_MOAN,
        coefficients: Nystrom {
            kick_first: false,
            drifts: &[
                0.037_859_319_840_611_016_23,
                0.102_635_633_102_436_605_54,
                -0.025_867_888_266_558_350_16,
                0.314_241_403_071_446_408_98,
                -0.130_144_459_517_415_197_49,
                0.106_417_700_369_541_830_10,
                -0.008_794_243_128_510_174_75,
                0.207_305_069_056_895_723_12,
            ],
            kicks: &[
                0.091_719_152_624_462_175_43,
                0.183_983_170_005_004_881_92,
                -0.056_534_365_832_889_169_49,
                0.004_914_688_774_711_813_04,
                0.143_761_127_168_361_842_07,
                0.328_567_693_746_803_455_71,
                -0.196_411_466_486_454_998_68,
            ],
        },
    };

    /// The Runge-Kutta-Nyström splitting of order 8 in nineteen stages: Blanes, Casas and Escorihuela-Tomàs,
    /// "Runge-Kutta-Nyström symplectic splitting methods of order 8", Appl. Numer. Math. 182 (2022) 14-27.
    pub const BLANES_CASAS_8: Self = SplittingScheme {
        name: "blanes_casas_8",
        order: 8,
        stages: 19,
        source: "Blanes, Casas and Escorihuela-Tomàs, Appl. Numer. Math. 182 (2022) 14-27",
        coefficients: Nystrom {
            kick_first: false,
            drifts: &[
                0.050_580_5,
                0.149_999,
                -0.055_179_551_077_161_557_35,
                0.423_755_898_835_337_951_48,
                -0.213_495_353_584_659_048_06,
                -0.068_076_977_457_403_261_91,
                0.227_917_056_974_013_435_95,
                -0.235_373_619_381_058_906_52,
                0.387_413_869_179_878_047_82,
                -0.167_540_823_488_946_661_40,
            ],
            kicks: &[
                0.129_478_606_560_536_730_66,
                0.222_257_260_092_671_143_42,
                -0.057_751_489_332_514_720_48,
                -0.057_831_226_210_392_491_02,
                0.103_087_297_437_175_356_75,
                -0.140_819_612_554_090_768_21,
                0.023_446_260_349_282_627_67,
                0.134_854_517_356_684_096_62,
                0.028_797_382_107_377_930_63,
                0.228_962_008_386_540_187_90,
            ],
        },
    };

    /// Every scheme: compositions first, then Runge-Kutta-Nyström splittings, each by order.
    pub const ALL: [Self; 15] = [
        Self::STRANG,
        Self::YOSHIDA_4,
        Self::SUZUKI_4,
        Self::MCLACHLAN_4,
        Self::YOSHIDA_6,
        Self::KAHAN_LI_6,
        Self::SOFRONIOU_SPALETTA_6,
        Self::SUZUKI_UMENO_8,
        Self::KAHAN_LI_8,
        Self::SOFRONIOU_SPALETTA_8,
        Self::SOFRONIOU_SPALETTA_10,
        Self::BLANES_MOAN_4,
        Self::BLANES_MOAN_6,
        Self::BLANES_MOAN_6_LONG,
        Self::BLANES_CASAS_8,
    ];

    /// The name in tables, in lower case with underscores.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// The order.
    pub const fn order(&self) -> u32 {
        self.order
    }

    /// The number of force evaluations in a step.
    pub const fn stages(&self) -> usize {
        self.stages
    }

    /// The publication of the coefficients.
    pub const fn source(&self) -> &'static str {
        self.source
    }

    /// Whether the order relies on the hypothesis of Runge-Kutta-Nyström methods.
    pub const fn is_nystrom(&self) -> bool {
        matches!(self.coefficients, Nystrom { .. })
    }

    /// The substeps `g_1, ..., g_s` of a composition; `None` for a Runge-Kutta-Nyström splitting.
    pub fn substeps(&self) -> Option<Vec<f64>> {
        match self.coefficients {
            Composition(half) => Some(mirrored(half, self.stages)),
            Nystrom { .. } => None,
        }
    }

    /// The drifts `d_1, ..., d_n` and the kicks `k_0, ..., k_n`. A scheme that begins with a drift has `k_0 = k_n = 0`.
    pub fn coefficients(&self) -> (Vec<f64>, Vec<f64>) {
        match self.coefficients {
            Composition(half) => {
                let g = mirrored(half, self.stages);
                let mut kicks = vec![0.0; g.len() + 1];
                for (i, substep) in g.iter().enumerate() {
                    kicks[i] += 0.5 * substep;
                    kicks[i + 1] += 0.5 * substep;
                }
                (g, kicks)
            }
            Nystrom { kick_first: true, drifts, kicks } => {
                (mirrored(drifts, self.stages), mirrored(kicks, self.stages + 1))
            }
            Nystrom { kick_first: false, drifts, kicks } => {
                let mut padded = vec![0.0];
                padded.extend(mirrored(kicks, self.stages));
                padded.push(0.0);
                (mirrored(drifts, self.stages + 1), padded)
            }
        }
    }
}

/// The symmetric sequence of this length from its first half.
fn mirrored(half: &[f64], length: usize) -> Vec<f64> {
    (0..length).map(|i| half[i.min(length - 1 - i)]).collect()
}
