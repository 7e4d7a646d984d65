"""What tests share: slow, plain solutions that use none of the package, recordings of all formats,
golden numbers.
"""
