//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [100.554, 187.215, 100.554], // a step, with its operations and its action aside
    [10.498, 13.495, 10.498], // a value of the observation
    [270.190, 404.690, 270.190], // an action
    [23.601, 31.893, 23.601], // a value of the action
    [8.248, 11.375, 9.054], // a value of an array of the action contract
    [85.681, 180.288, 85.681], // a call that runs one operation
    [0.000, 0.000, 85.681], // a call that runs pieces
    [0.000, 0.000, 80.482], // an operation that a poll comes to
    [0.000, 0.000, 214.280], // a piece
    [397.911, 710.129, 397.911], // a linear operation
    [0.000, 0.000, 836.313], // a block of rows of a linear operation that a poll comes to
    [26.937, 36.892, 26.937], // eight values compared by magnitude
    [9.959, 12.531, 9.959], // a value compared by magnitude
    [192.472, 276.539, 192.472], // a block of rows whose order is looked at
    [110.880, 194.521, 110.880], // a linear operation that sets its output up before the rows are added
    [1.211, 2.584, 1.211], // an output set to 0 before the rows are added
    [4.812, 7.695, 4.812], // an output set to its bias before the rows are added
    [126.122, 195.496, 126.122], // a block of rows in order, whole strips
    [35.198, 49.132, 35.198], // a block of rows with sums on the stack
    [107.914, 175.600, 107.914], // a run of rows with sums on the stack
    [49.029, 76.766, 49.029], // eight rows scaled by the assembler
    [8.740, 14.951, 8.740], // a row in order scaled
    [32.165, 45.364, 32.165], // a row with an index scaled
    [287.588, 479.825, 287.588], // a normalization
    [24.769, 29.013, 24.992], // a value normalized
    [301.154, 526.584, 301.154], // a layer norm
    [17.762, 25.511, 17.762], // a value of a layer norm
    [259.445, 471.757, 259.445], // an RMS norm
    [10.250, 12.496, 10.250], // a value of an RMS norm
    [210.835, 387.786, 210.835], // an addition
    [5.248, 6.749, 5.248], // a value added
    [213.765, 392.452, 213.765], // a copy
    [2.750, 4.249, 2.750], // a value copied
    [282.564, 526.417, 282.564], // an LSTM cell
    [119.968, 201.908, 216.887], // an element of an LSTM cell
    [301.450, 545.096, 301.450], // a GRU cell
    [86.982, 147.948, 159.749], // an element of a GRU cell
    [204.529, 374.435, 204.529], // a function's operation
    [7.535, 8.408, 7.569], // an element of relu
    [18.927, 35.643, 52.984], // an element of elu
    [25.553, 48.586, 48.569], // an element of silu
    [29.762, 46.771, 29.781], // an element of gelu
    [28.578, 54.631, 51.630], // an element of gelu_tanh
    [25.553, 48.073, 48.569], // an element of tanh
    [24.587, 47.622, 47.630], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [721.389, 1149.391, 721.389], // 2 bits single rows prepared: a chunk
    [223.867, 325.872, 223.867], // 2 bits single rows prepared: a chunk written by itself
    [32.031, 46.026, 32.031], // 2 bits single rows prepared: eight values
    [18.942, 26.734, 18.942], // 2 bits single rows prepared: a value of the rest
    [3.730, 6.466, 3.730], // 2 bits single rows prepared: a pair of padding
    [644.756, 1049.693, 644.756], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [9.172, 11.113, 9.172], // 2 bits single groups prepared: a chunk
    [259.664, 386.062, 259.664], // 2 bits single groups prepared: a chunk written by itself
    [33.060, 47.806, 33.060], // 2 bits single groups prepared: eight values
    [13.709, 17.822, 13.709], // 2 bits single groups prepared: a value of the rest
    [1.705, 3.362, 1.705], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [663.689, 1055.577, 663.689], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [312.934, 460.846, 312.934], // 2 bits paired rows prepared: a chunk written by itself
    [39.677, 54.795, 39.677], // 2 bits paired rows prepared: eight values
    [6.905, 10.092, 6.905], // 2 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a pair of padding
    [672.019, 1088.403, 672.019], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [82.407, 129.546, 82.407], // 2 bits paired groups prepared: a chunk
    [252.510, 376.251, 252.510], // 2 bits paired groups prepared: a chunk written by itself
    [20.784, 24.658, 20.784], // 2 bits paired groups prepared: eight values
    [14.019, 17.462, 14.019], // 2 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [672.635, 1064.430, 672.635], // 3 bits single rows prepared: a chunk
    [262.937, 391.079, 262.937], // 3 bits single rows prepared: a chunk written by itself
    [32.198, 46.322, 32.198], // 3 bits single rows prepared: eight values
    [13.535, 17.683, 13.535], // 3 bits single rows prepared: a value of the rest
    [0.950, 1.840, 0.950], // 3 bits single rows prepared: a pair of padding
    [652.128, 1065.755, 652.128], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [10.035, 12.687, 10.035], // 3 bits single groups prepared: a chunk
    [261.253, 386.908, 261.253], // 3 bits single groups prepared: a chunk written by itself
    [32.775, 47.246, 32.775], // 3 bits single groups prepared: eight values
    [13.353, 17.397, 13.353], // 3 bits single groups prepared: a value of the rest
    [1.049, 2.164, 1.049], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [677.342, 1073.246, 677.342], // 3 bits paired rows prepared: a group
    [39.289, 55.254, 39.289], // 3 bits paired rows prepared: a chunk
    [292.949, 430.072, 292.949], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [13.845, 18.806, 13.845], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [738.359, 1209.280, 738.359], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk
    [13.794, 51.308, 13.794], // 3 bits paired groups prepared: a chunk written by itself
    [40.102, 56.255, 40.102], // 3 bits paired groups prepared: eight values
    [56.404, 77.099, 56.404], // 3 bits paired groups prepared: a value of the rest
    [43.003, 55.010, 43.003], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [676.020, 1072.846, 676.020], // 4 bits single rows prepared: a chunk
    [255.373, 378.444, 255.373], // 4 bits single rows prepared: a chunk written by itself
    [32.078, 46.118, 32.078], // 4 bits single rows prepared: eight values
    [13.869, 18.250, 13.869], // 4 bits single rows prepared: a value of the rest
    [1.015, 1.989, 1.015], // 4 bits single rows prepared: a pair of padding
    [646.746, 1053.855, 646.746], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [8.702, 10.302, 8.702], // 4 bits single groups prepared: a chunk
    [254.236, 374.415, 254.236], // 4 bits single groups prepared: a chunk written by itself
    [33.161, 47.980, 33.161], // 4 bits single groups prepared: eight values
    [14.664, 19.820, 14.664], // 4 bits single groups prepared: a value of the rest
    [2.371, 4.757, 2.371], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [616.522, 972.509, 616.522], // 4 bits paired rows prepared: a group
    [50.889, 94.167, 50.889], // 4 bits paired rows prepared: a chunk
    [306.166, 455.905, 306.166], // 4 bits paired rows prepared: a chunk written by itself
    [36.885, 51.270, 36.885], // 4 bits paired rows prepared: eight values
    [7.997, 9.309, 7.997], // 4 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a pair of padding
    [668.022, 1084.964, 668.022], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [88.486, 138.918, 88.486], // 4 bits paired groups prepared: a chunk
    [247.256, 370.186, 247.256], // 4 bits paired groups prepared: a chunk written by itself
    [18.658, 22.434, 18.658], // 4 bits paired groups prepared: eight values
    [15.593, 19.368, 15.593], // 4 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [713.122, 1130.524, 713.122], // 8 bits single rows prepared: a chunk
    [230.893, 338.861, 230.893], // 8 bits single rows prepared: a chunk written by itself
    [32.020, 45.900, 32.020], // 8 bits single rows prepared: eight values
    [15.995, 21.287, 15.995], // 8 bits single rows prepared: a value of the rest
    [2.181, 3.606, 2.181], // 8 bits single rows prepared: a pair of padding
    [645.457, 1051.892, 645.457], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [8.654, 10.330, 8.654], // 8 bits single groups prepared: a chunk
    [253.126, 371.492, 253.126], // 8 bits single groups prepared: a chunk written by itself
    [33.152, 47.921, 33.152], // 8 bits single groups prepared: eight values
    [14.908, 20.394, 14.908], // 8 bits single groups prepared: a value of the rest
    [2.479, 5.004, 2.479], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [571.921, 911.035, 571.921], // 8 bits paired rows prepared: a group
    [122.902, 190.180, 122.902], // 8 bits paired rows prepared: a chunk
    [270.044, 399.157, 270.044], // 8 bits paired rows prepared: a chunk written by itself
    [32.274, 46.325, 32.274], // 8 bits paired rows prepared: eight values
    [11.944, 15.247, 11.944], // 8 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a pair of padding
    [612.630, 1007.132, 612.630], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [26.939, 39.598, 26.939], // 8 bits paired groups prepared: a chunk
    [276.084, 415.702, 276.084], // 8 bits paired groups prepared: a chunk written by itself
    [29.297, 41.656, 29.297], // 8 bits paired groups prepared: eight values
    [12.213, 14.682, 12.213], // 8 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a pair of padding
    [0.000, 13.029, 0.000], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [3.275, 6.819, 3.275], // 2 bits single rows, 4 rows: a pass or group of a strip
    [12.157, 26.069, 12.157], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.306, 5.038, 4.306], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [86.743, 152.758, 86.743], // 2 bits single groups, 4 rows: a call
    [13.138, 29.492, 13.138], // 2 bits single groups, 4 rows: a strip
    [23.938, 43.472, 23.938], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.403, 5.237, 4.403], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [67.797, 121.478, 67.797], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [38.528, 67.445, 38.528], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.352, 1.596, 1.352], // 2 bits paired rows, 4 rows: a column of a strip
    [54.199, 96.156, 54.199], // 2 bits paired rows, 8 rows: a call
    [30.207, 57.758, 30.207], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [20.033, 42.245, 20.033], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.177, 5.157, 4.177], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [55.500, 113.318, 55.500], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.778, 3.939, 2.778], // 2 bits paired groups, 4 rows: a column of a strip
    [44.361, 85.986, 44.361], // 2 bits paired groups, 8 rows: a call
    [23.348, 48.953, 23.348], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.344, 7.090, 5.344], // 2 bits paired groups, 8 rows: a column of a strip
    [41.057, 84.751, 41.057], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [10.672, 22.054, 10.672], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.186, 6.152, 5.186], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [84.771, 148.255, 84.771], // 3 bits single groups, 4 rows: a call
    [9.706, 23.593, 9.706], // 3 bits single groups, 4 rows: a strip
    [24.773, 44.180, 24.773], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.192, 6.159, 5.192], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [38.412, 79.780, 38.412], // 3 bits paired rows, 4 rows: a call
    [20.746, 37.842, 20.746], // 3 bits paired rows, 4 rows: a strip
    [6.709, 14.013, 6.709], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.107, 4.101, 3.107], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a call
    [10.650, 25.368, 10.650], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.715, 5.088, 3.715], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [45.454, 88.870, 45.454], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [3.324, 6.478, 3.324], // 4 bits single rows, 4 rows: a pass or group of a strip
    [12.079, 26.137, 12.079], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.366, 5.359, 4.366], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [83.036, 145.140, 83.036], // 4 bits single groups, 4 rows: a call
    [13.638, 30.481, 13.638], // 4 bits single groups, 4 rows: a strip
    [24.044, 43.659, 24.044], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.462, 5.543, 4.462], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [0.000, 14.262, 0.000], // 4 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [76.462, 122.765, 76.462], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.421, 4.427, 3.421], // 4 bits paired rows, 4 rows: a column of a strip
    [44.195, 77.965, 44.195], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [2.839, 5.903, 2.839], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [31.251, 53.869, 31.251], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.789, 8.298, 6.789], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [52.349, 108.903, 52.349], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.114, 5.527, 4.114], // 4 bits paired groups, 4 rows: a column of a strip
    [40.335, 79.115, 40.335], // 4 bits paired groups, 8 rows: a call
    [21.255, 46.870, 21.255], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.847, 10.093, 7.847], // 4 bits paired groups, 8 rows: a column of a strip
    [14.007, 39.324, 14.007], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [4.708, 8.972, 4.708], // 8 bits single rows, 4 rows: a pass or group of a strip
    [10.438, 23.461, 10.438], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.448, 5.909, 4.448], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [82.354, 145.316, 82.354], // 8 bits single groups, 4 rows: a call
    [13.618, 30.419, 13.618], // 8 bits single groups, 4 rows: a strip
    [24.058, 43.676, 24.058], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.587, 6.170, 4.587], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [18.704, 46.060, 18.704], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [2.509, 5.306, 2.509], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [17.213, 33.323, 17.213], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.377, 4.877, 3.377], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [92.497, 158.644, 92.497], // 8 bits paired groups, 4 rows: a call
    [11.561, 26.336, 11.561], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.063, 6.093, 4.063], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];
