//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [94.155, 167.321, 94.155], // a step, with its operations and its action aside
    [8.999, 14.497, 8.999], // a value of the observation
    [327.576, 533.994, 327.576], // an action
    [41.612, 56.598, 41.612], // a value of the action
    [5.483, 5.102, 6.047], // a value of an array of the action contract
    [91.048, 181.673, 91.048], // a call that runs one operation
    [0.000, 0.000, 91.048], // a call that runs pieces
    [0.000, 0.000, 168.073], // an operation that a poll comes to
    [0.000, 0.000, 360.214], // a piece
    [418.805, 742.435, 418.805], // a linear operation
    [0.000, 0.000, 701.145], // a block of rows of a linear operation that a poll comes to
    [26.994, 37.018, 26.994], // eight values compared by magnitude
    [7.730, 9.976, 7.730], // a value compared by magnitude
    [0.000, 0.000, 0.000], // a block of rows whose order is looked at
    [111.191, 211.676, 111.191], // a linear operation that sets its output up before the rows are added
    [1.429, 3.140, 1.429], // an output set to 0 before the rows are added
    [0.000, 0.642, 0.000], // an output set to its bias before the rows are added
    [156.621, 242.700, 156.621], // a block of rows in order, whole strips
    [92.839, 153.199, 92.839], // a block of rows with sums on the stack
    [157.155, 261.532, 157.155], // a run of rows with sums on the stack
    [54.143, 92.578, 54.143], // eight rows scaled by the assembler
    [10.672, 19.479, 10.672], // a row in order scaled
    [18.712, 24.998, 18.712], // a row with an index scaled
    [445.969, 756.354, 445.969], // a normalization
    [23.998, 31.997, 24.000], // a value normalized
    [395.351, 749.737, 395.351], // a layer norm
    [18.010, 26.751, 18.010], // a value of a layer norm
    [325.503, 631.470, 325.503], // an RMS norm
    [10.750, 18.498, 10.750], // a value of an RMS norm
    [341.475, 613.693, 341.475], // an addition
    [4.990, 5.726, 4.990], // a value added
    [333.863, 603.803, 333.863], // a copy
    [1.000, 3.500, 1.000], // a value copied
    [376.108, 693.723, 376.108], // an LSTM cell
    [119.979, 201.947, 216.888], // an element of an LSTM cell
    [392.190, 708.646, 392.190], // a GRU cell
    [86.929, 147.931, 155.718], // an element of a GRU cell
    [324.726, 600.020, 324.726], // a function's operation
    [7.705, 8.539, 7.795], // an element of relu
    [17.787, 35.272, 44.067], // an element of elu
    [25.033, 52.332, 42.067], // an element of silu
    [29.860, 48.071, 30.310], // an element of gelu
    [28.050, 58.429, 45.098], // an element of gelu_tanh
    [25.033, 52.266, 42.067], // an element of tanh
    [24.033, 51.264, 41.067], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [707.004, 1250.521, 707.004], // 2 bits single rows prepared: a chunk
    [295.168, 476.029, 295.168], // 2 bits single rows prepared: a chunk written by itself
    [32.072, 46.087, 32.072], // 2 bits single rows prepared: eight values
    [19.804, 28.736, 19.804], // 2 bits single rows prepared: a value of the rest
    [3.436, 6.714, 3.436], // 2 bits single rows prepared: a pair of padding
    [614.208, 1088.519, 614.208], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [9.275, 10.559, 9.275], // 2 bits single groups prepared: a chunk
    [343.588, 551.881, 343.588], // 2 bits single groups prepared: a chunk written by itself
    [32.901, 47.689, 32.901], // 2 bits single groups prepared: eight values
    [12.344, 16.867, 12.344], // 2 bits single groups prepared: a value of the rest
    [0.000, 1.720, 0.000], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [655.153, 1163.029, 655.153], // 2 bits paired rows prepared: a group
    [8.490, 15.039, 8.490], // 2 bits paired rows prepared: a chunk
    [366.388, 586.369, 366.388], // 2 bits paired rows prepared: a chunk written by itself
    [37.507, 50.879, 37.507], // 2 bits paired rows prepared: eight values
    [9.588, 14.820, 9.588], // 2 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a pair of padding
    [652.098, 1151.092, 652.098], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [38.156, 86.250, 38.156], // 2 bits paired groups prepared: a chunk
    [339.949, 540.508, 339.949], // 2 bits paired groups prepared: a chunk written by itself
    [31.659, 35.230, 31.659], // 2 bits paired groups prepared: eight values
    [12.813, 16.716, 12.813], // 2 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [672.770, 1182.757, 672.770], // 3 bits single rows prepared: a chunk
    [323.239, 528.585, 323.239], // 3 bits single rows prepared: a chunk written by itself
    [32.172, 46.271, 32.172], // 3 bits single rows prepared: eight values
    [15.721, 20.968, 15.721], // 3 bits single rows prepared: a value of the rest
    [1.298, 2.626, 1.298], // 3 bits single rows prepared: a pair of padding
    [626.763, 1106.822, 626.763], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [9.897, 12.130, 9.897], // 3 bits single groups prepared: a chunk
    [337.692, 554.594, 337.692], // 3 bits single groups prepared: a chunk written by itself
    [32.656, 47.098, 32.656], // 3 bits single groups prepared: eight values
    [13.155, 16.161, 13.155], // 3 bits single groups prepared: a value of the rest
    [0.000, 0.198, 0.000], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [674.109, 1186.486, 674.109], // 3 bits paired rows prepared: a group
    [39.217, 55.018, 39.217], // 3 bits paired rows prepared: a chunk
    [345.225, 544.076, 345.225], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [14.133, 19.787, 14.133], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [715.069, 1270.764, 715.069], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk written by itself
    [39.869, 55.886, 39.869], // 3 bits paired groups prepared: eight values
    [65.893, 100.447, 65.893], // 3 bits paired groups prepared: a value of the rest
    [52.270, 81.641, 52.270], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [671.851, 1182.787, 671.851], // 4 bits single rows prepared: a chunk
    [319.626, 520.729, 319.626], // 4 bits single rows prepared: a chunk written by itself
    [32.101, 46.174, 32.101], // 4 bits single rows prepared: eight values
    [15.882, 21.528, 15.882], // 4 bits single rows prepared: a value of the rest
    [1.304, 2.935, 1.304], // 4 bits single rows prepared: a pair of padding
    [614.561, 1092.882, 614.561], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [8.799, 9.670, 8.799], // 4 bits single groups prepared: a chunk
    [340.156, 538.066, 340.156], // 4 bits single groups prepared: a chunk written by itself
    [33.010, 47.886, 33.010], // 4 bits single groups prepared: eight values
    [13.013, 19.244, 13.013], // 4 bits single groups prepared: a value of the rest
    [0.511, 3.389, 0.511], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [592.171, 1034.344, 592.171], // 4 bits paired rows prepared: a group
    [76.889, 159.988, 76.889], // 4 bits paired rows prepared: a chunk
    [359.375, 584.017, 359.375], // 4 bits paired rows prepared: a chunk written by itself
    [36.490, 50.386, 36.490], // 4 bits paired rows prepared: eight values
    [11.145, 14.005, 11.145], // 4 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a pair of padding
    [651.221, 1154.758, 651.221], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [40.219, 95.057, 40.219], // 4 bits paired groups prepared: a chunk
    [340.002, 540.107, 340.002], // 4 bits paired groups prepared: a chunk written by itself
    [30.542, 33.147, 30.542], // 4 bits paired groups prepared: eight values
    [13.922, 18.442, 13.922], // 4 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [681.128, 1187.520, 681.128], // 8 bits single rows prepared: a chunk
    [309.459, 506.067, 309.459], // 8 bits single rows prepared: a chunk written by itself
    [31.950, 45.728, 31.950], // 8 bits single rows prepared: eight values
    [16.590, 22.115, 16.590], // 8 bits single rows prepared: a value of the rest
    [1.883, 3.204, 1.883], // 8 bits single rows prepared: a pair of padding
    [613.038, 1090.311, 613.038], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [8.736, 9.734, 8.736], // 8 bits single groups prepared: a chunk
    [339.143, 534.573, 339.143], // 8 bits single groups prepared: a chunk written by itself
    [33.005, 47.815, 33.005], // 8 bits single groups prepared: eight values
    [13.254, 19.948, 13.254], // 8 bits single groups prepared: a value of the rest
    [0.615, 3.701, 0.615], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [532.876, 961.500, 532.876], // 8 bits paired rows prepared: a group
    [142.088, 221.060, 142.088], // 8 bits paired rows prepared: a chunk
    [344.397, 546.547, 344.397], // 8 bits paired rows prepared: a chunk written by itself
    [31.974, 45.747, 31.974], // 8 bits paired rows prepared: eight values
    [11.888, 17.699, 11.888], // 8 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a pair of padding
    [604.684, 1080.411, 604.684], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a chunk
    [359.278, 589.624, 359.278], // 8 bits paired groups prepared: a chunk written by itself
    [35.881, 51.321, 35.881], // 8 bits paired groups prepared: eight values
    [11.732, 13.777, 11.732], // 8 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a pair of padding
    [1.524, 17.274, 1.524], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [2.820, 6.844, 2.820], // 2 bits single rows, 4 rows: a pass or group of a strip
    [12.949, 27.933, 12.949], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.318, 5.065, 4.318], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [86.198, 162.875, 86.198], // 2 bits single groups, 4 rows: a call
    [11.537, 25.111, 11.537], // 2 bits single groups, 4 rows: a strip
    [23.812, 42.398, 23.812], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.407, 5.273, 4.407], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [54.662, 96.473, 54.662], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [33.724, 63.913, 33.724], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.935, 2.330, 1.935], // 2 bits paired rows, 4 rows: a column of a strip
    [48.170, 92.299, 48.170], // 2 bits paired rows, 8 rows: a call
    [25.652, 43.077, 25.652], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [19.721, 41.382, 19.721], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.179, 5.170, 4.179], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [46.115, 100.156, 46.115], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [3.010, 4.213, 3.010], // 2 bits paired groups, 4 rows: a column of a strip
    [36.363, 80.582, 36.363], // 2 bits paired groups, 8 rows: a call
    [17.584, 32.620, 17.584], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.348, 7.095, 5.348], // 2 bits paired groups, 8 rows: a column of a strip
    [32.092, 78.828, 32.092], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [12.127, 26.281, 12.127], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.186, 6.183, 5.186], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [78.893, 157.635, 78.893], // 3 bits single groups, 4 rows: a call
    [9.169, 19.783, 9.169], // 3 bits single groups, 4 rows: a strip
    [23.698, 42.125, 23.698], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.195, 6.196, 5.195], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [30.111, 73.667, 30.111], // 3 bits paired rows, 4 rows: a call
    [18.165, 29.650, 18.165], // 3 bits paired rows, 4 rows: a strip
    [6.582, 14.079, 6.582], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.110, 4.104, 3.110], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a call
    [7.988, 17.583, 7.988], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.714, 5.087, 3.714], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [37.049, 84.144, 37.049], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [3.056, 6.642, 3.056], // 4 bits single rows, 4 rows: a pass or group of a strip
    [12.814, 28.060, 12.814], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.373, 5.383, 4.373], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [84.008, 154.330, 84.008], // 4 bits single groups, 4 rows: a call
    [12.059, 26.290, 12.059], // 4 bits single groups, 4 rows: a strip
    [23.919, 42.598, 23.919], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.466, 5.578, 4.466], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [0.498, 46.364, 0.498], // 4 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [57.966, 56.932, 57.966], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.761, 5.163, 3.761], // 4 bits paired rows, 4 rows: a column of a strip
    [38.438, 74.446, 38.438], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [3.133, 6.172, 3.133], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [26.381, 38.333, 26.381], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.771, 8.283, 6.771], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [43.707, 96.669, 43.707], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.344, 5.859, 4.344], // 4 bits paired groups, 4 rows: a column of a strip
    [33.083, 74.480, 33.083], // 4 bits paired groups, 8 rows: a call
    [15.428, 30.487, 15.428], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.851, 10.098, 7.851], // 4 bits paired groups, 8 rows: a column of a strip
    [24.910, 69.234, 24.910], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [3.598, 7.604, 3.598], // 8 bits single rows, 4 rows: a pass or group of a strip
    [12.127, 27.141, 12.127], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.482, 5.982, 4.482], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [83.528, 154.979, 83.528], // 8 bits single groups, 4 rows: a call
    [12.046, 26.232, 12.046], // 8 bits single groups, 4 rows: a strip
    [23.933, 42.608, 23.933], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.591, 6.205, 4.591], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [26.063, 67.254, 26.063], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [2.724, 5.977, 2.724], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [14.875, 25.671, 14.875], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.378, 4.877, 3.378], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [79.117, 152.798, 79.117], // 8 bits paired groups, 4 rows: a call
    [8.777, 18.322, 8.777], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.064, 6.095, 4.064], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];
