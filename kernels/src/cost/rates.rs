//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [100.563, 187.229, 100.563], // a step, with its operations and its action aside
    [10.498, 13.495, 10.498], // a value of the observation
    [270.156, 404.628, 270.156], // an action
    [23.601, 31.893, 23.601], // a value of the action
    [8.248, 11.375, 9.054], // a value of an array of the action contract
    [85.734, 180.382, 85.734], // a call that runs one operation
    [0.000, 0.000, 85.734], // a call that runs pieces
    [0.000, 0.000, 53.250], // an operation that a poll comes to
    [0.000, 0.000, 209.306], // a piece
    [397.494, 708.624, 397.494], // a linear operation
    [0.000, 0.000, 871.051], // a block of rows of a linear operation that a poll comes to
    [26.605, 36.378, 26.605], // eight values compared by magnitude
    [3.934, 3.036, 3.934], // a value compared by magnitude
    [195.341, 281.959, 195.341], // a block of rows whose order is looked at
    [109.036, 193.316, 109.036], // a linear operation that sets its output up before the rows are added
    [1.455, 2.996, 1.455], // an output set to 0 before the rows are added
    [4.775, 7.622, 4.775], // an output set to its bias before the rows are added
    [14.278, 26.048, 14.278], // a block of rows in order, whole strips
    [0.000, 0.000, 0.000], // a block of rows with sums on the stack
    [36.111, 61.248, 36.111], // a run of rows with sums on the stack
    [15.984, 15.433, 15.984], // eight rows scaled by the assembler
    [0.000, 0.000, 0.000], // a row in order scaled
    [27.534, 36.968, 27.534], // a row with an index scaled
    [287.534, 479.730, 287.534], // a normalization
    [24.769, 29.014, 24.992], // a value normalized
    [301.101, 526.489, 301.101], // a layer norm
    [17.763, 25.511, 17.763], // a value of a layer norm
    [259.393, 471.664, 259.393], // an RMS norm
    [10.250, 12.496, 10.250], // a value of an RMS norm
    [210.782, 387.692, 210.782], // an addition
    [5.248, 6.749, 5.248], // a value added
    [213.713, 392.359, 213.713], // a copy
    [2.750, 4.249, 2.750], // a value copied
    [282.499, 526.299, 282.499], // an LSTM cell
    [119.970, 201.911, 216.887], // an element of an LSTM cell
    [301.391, 544.989, 301.391], // a GRU cell
    [86.983, 147.950, 159.749], // an element of a GRU cell
    [204.476, 374.329, 204.476], // a function's operation
    [7.535, 8.408, 7.569], // an element of relu
    [18.927, 35.643, 52.984], // an element of elu
    [25.553, 48.587, 48.569], // an element of silu
    [29.763, 46.771, 29.782], // an element of gelu
    [28.578, 54.631, 51.630], // an element of gelu_tanh
    [25.553, 48.073, 48.569], // an element of tanh
    [24.587, 47.617, 47.630], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [803.800, 1285.811, 803.800], // 2 bits single rows prepared: a chunk
    [218.204, 313.645, 218.204], // 2 bits single rows prepared: a chunk written by itself
    [31.976, 45.954, 31.976], // 2 bits single rows prepared: eight values
    [20.943, 30.490, 20.943], // 2 bits single rows prepared: a value of the rest
    [3.729, 6.772, 3.729], // 2 bits single rows prepared: a pair of padding
    [840.754, 1366.849, 840.754], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [7.172, 7.797, 7.172], // 2 bits single groups prepared: a chunk
    [132.556, 180.049, 132.556], // 2 bits single groups prepared: a chunk written by itself
    [33.509, 48.504, 33.509], // 2 bits single groups prepared: eight values
    [38.131, 56.685, 38.131], // 2 bits single groups prepared: a value of the rest
    [12.752, 21.425, 12.752], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [726.717, 1148.371, 726.717], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [42.397, 63.907, 42.397], // 2 bits paired rows prepared: a chunk written by itself
    [39.951, 55.278, 39.951], // 2 bits paired rows prepared: eight values
    [41.377, 60.749, 41.377], // 2 bits paired rows prepared: a value of the rest
    [71.022, 104.526, 71.022], // 2 bits paired rows prepared: a pair of padding
    [786.880, 1263.341, 786.880], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [167.609, 231.494, 167.609], // 2 bits paired groups prepared: a chunk
    [159.565, 233.664, 159.565], // 2 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: eight values
    [30.824, 43.982, 30.824], // 2 bits paired groups prepared: a value of the rest
    [2.677, 6.002, 2.677], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [781.944, 1248.076, 781.944], // 3 bits single rows prepared: a chunk
    [254.682, 366.410, 254.682], // 3 bits single rows prepared: a chunk written by itself
    [32.152, 46.292, 32.152], // 3 bits single rows prepared: eight values
    [14.314, 20.868, 14.314], // 3 bits single rows prepared: a value of the rest
    [1.592, 4.018, 1.592], // 3 bits single rows prepared: a pair of padding
    [847.350, 1381.441, 847.350], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [8.631, 10.266, 8.631], // 3 bits single groups prepared: a chunk
    [141.563, 189.490, 141.563], // 3 bits single groups prepared: a chunk written by itself
    [33.068, 47.717, 33.068], // 3 bits single groups prepared: eight values
    [36.434, 54.767, 36.434], // 3 bits single groups prepared: a value of the rest
    [11.355, 19.303, 11.355], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [784.932, 1258.815, 784.932], // 3 bits paired rows prepared: a group
    [39.595, 55.780, 39.595], // 3 bits paired rows prepared: a chunk
    [312.506, 464.186, 312.506], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [10.945, 14.518, 10.945], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [830.737, 1351.401, 830.737], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [40.977, 57.609, 40.977], // 3 bits paired groups prepared: a chunk
    [130.545, 192.886, 130.545], // 3 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: eight values
    [39.911, 57.940, 39.911], // 3 bits paired groups prepared: a value of the rest
    [26.960, 40.099, 26.960], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [798.954, 1273.345, 798.954], // 4 bits single rows prepared: a chunk
    [220.885, 324.330, 220.885], // 4 bits single rows prepared: a chunk written by itself
    [31.989, 45.978, 31.989], // 4 bits single rows prepared: eight values
    [20.084, 27.697, 20.084], // 4 bits single rows prepared: a value of the rest
    [3.583, 6.131, 3.583], // 4 bits single rows prepared: a pair of padding
    [839.242, 1365.199, 839.242], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [6.861, 7.316, 6.861], // 4 bits single groups prepared: a chunk
    [128.341, 171.049, 128.341], // 4 bits single groups prepared: a chunk written by itself
    [33.580, 48.612, 33.580], // 4 bits single groups prepared: eight values
    [38.937, 58.418, 38.937], // 4 bits single groups prepared: a value of the rest
    [13.291, 22.512, 13.291], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [739.541, 1170.103, 739.541], // 4 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a chunk
    [63.926, 90.908, 63.926], // 4 bits paired rows prepared: a chunk written by itself
    [37.241, 51.851, 37.241], // 4 bits paired rows prepared: eight values
    [39.322, 56.924, 39.322], // 4 bits paired rows prepared: a value of the rest
    [61.153, 91.859, 61.153], // 4 bits paired rows prepared: a pair of padding
    [788.785, 1268.730, 788.785], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [164.883, 231.574, 164.883], // 4 bits paired groups prepared: a chunk
    [153.653, 225.275, 153.653], // 4 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: eight values
    [33.170, 47.125, 33.170], // 4 bits paired groups prepared: a value of the rest
    [3.107, 6.519, 3.107], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [805.030, 1276.489, 805.030], // 8 bits single rows prepared: a chunk
    [228.182, 336.487, 228.182], // 8 bits single rows prepared: a chunk written by itself
    [32.163, 46.119, 32.163], // 8 bits single rows prepared: eight values
    [21.461, 29.457, 21.461], // 8 bits single rows prepared: a value of the rest
    [1.998, 3.181, 1.998], // 8 bits single rows prepared: a pair of padding
    [837.245, 1363.543, 837.245], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [6.613, 7.038, 6.613], // 8 bits single groups prepared: a chunk
    [126.902, 167.192, 126.902], // 8 bits single groups prepared: a chunk written by itself
    [33.616, 48.614, 33.616], // 8 bits single groups prepared: eight values
    [39.273, 59.152, 39.273], // 8 bits single groups prepared: a value of the rest
    [13.441, 22.828, 13.441], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [784.751, 1246.031, 784.751], // 8 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a chunk
    [177.969, 272.319, 177.969], // 8 bits paired rows prepared: a chunk written by itself
    [32.450, 46.589, 32.450], // 8 bits paired rows prepared: eight values
    [28.371, 38.599, 28.371], // 8 bits paired rows prepared: a value of the rest
    [23.860, 33.522, 23.860], // 8 bits paired rows prepared: a pair of padding
    [814.475, 1332.115, 814.475], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [144.711, 206.964, 144.711], // 8 bits paired groups prepared: a chunk
    [148.344, 212.150, 148.344], // 8 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: eight values
    [32.947, 47.758, 32.947], // 8 bits paired groups prepared: a value of the rest
    [3.653, 7.140, 3.653], // 8 bits paired groups prepared: a pair of padding
    [29.645, 45.949, 29.645], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [7.057, 12.539, 7.057], // 2 bits single rows, 4 rows: a pass or group of a strip
    [26.494, 53.484, 26.494], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.205, 4.885, 4.205], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [0.000, 1.221, 0.000], // 2 bits single groups, 4 rows: a call
    [29.537, 59.923, 29.537], // 2 bits single groups, 4 rows: a strip
    [24.095, 43.728, 24.095], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.405, 5.240, 4.405], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [119.806, 206.933, 119.806], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [38.376, 65.095, 38.376], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.292, 1.566, 1.292], // 2 bits paired rows, 4 rows: a column of a strip
    [94.410, 159.484, 94.410], // 2 bits paired rows, 8 rows: a call
    [65.584, 122.665, 65.584], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [15.174, 34.899, 15.174], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.323, 5.377, 4.323], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [67.298, 135.803, 67.298], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.661, 3.744, 2.661], // 2 bits paired groups, 4 rows: a column of a strip
    [40.353, 79.462, 40.353], // 2 bits paired groups, 8 rows: a call
    [56.233, 110.037, 56.233], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.344, 7.090, 5.344], // 2 bits paired groups, 8 rows: a column of a strip
    [40.174, 63.468, 40.174], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [26.300, 51.581, 26.300], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.204, 6.177, 5.204], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a call
    [25.780, 53.602, 25.780], // 3 bits single groups, 4 rows: a strip
    [24.830, 44.291, 24.830], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.199, 6.169, 5.199], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [37.113, 54.409, 37.113], // 3 bits paired rows, 4 rows: a call
    [36.691, 67.840, 36.691], // 3 bits paired rows, 4 rows: a strip
    [7.245, 14.567, 7.245], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.105, 4.101, 3.105], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [2.019, 0.000, 2.019], // 3 bits paired groups, 4 rows: a call
    [26.672, 55.353, 26.672], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.725, 5.102, 3.725], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [33.785, 55.868, 33.785], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [6.008, 10.478, 6.008], // 4 bits single rows, 4 rows: a pass or group of a strip
    [26.493, 53.676, 26.493], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.300, 5.262, 4.300], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a call
    [29.999, 60.852, 29.999], // 4 bits single groups, 4 rows: a strip
    [24.164, 43.849, 24.164], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.464, 5.548, 4.464], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [59.023, 112.689, 59.023], // 4 bits paired rows, 4 rows: a strip
    [0.000, 7.094, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [61.468, 94.677, 61.468], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.452, 4.291, 3.452], // 4 bits paired rows, 4 rows: a column of a strip
    [81.950, 141.896, 81.950], // 4 bits paired rows, 8 rows: a call
    [16.499, 25.783, 16.499], // 4 bits paired rows, 8 rows: a strip
    [1.689, 4.193, 1.689], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [48.604, 90.685, 48.604], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.827, 8.351, 6.827], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [59.691, 124.875, 59.691], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.012, 5.352, 4.012], // 4 bits paired groups, 4 rows: a column of a strip
    [31.684, 65.472, 31.684], // 4 bits paired groups, 8 rows: a call
    [53.930, 107.712, 53.930], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.850, 10.096, 7.850], // 4 bits paired groups, 8 rows: a column of a strip
    [29.266, 54.495, 29.266], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [7.519, 13.431, 7.519], // 8 bits single rows, 4 rows: a pass or group of a strip
    [25.088, 51.127, 25.088], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.372, 5.788, 4.372], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a call
    [29.996, 60.805, 29.996], // 8 bits single groups, 4 rows: a strip
    [24.218, 43.931, 24.218], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.588, 6.172, 4.588], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [32.235, 56.722, 32.235], // 8 bits paired rows, 4 rows: a call
    [33.538, 54.243, 33.538], // 8 bits paired rows, 4 rows: a strip
    [2.467, 5.093, 2.467], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 9.485, 0.000], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.384, 4.889, 3.384], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a call
    [27.780, 56.447, 27.780], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.069, 6.103, 4.069], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];
